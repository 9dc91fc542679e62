#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""answers.py ROOT PROGRAM: what --json prints is what docs/start/answers.schema.json says, for each verb that has the option, and the
schema refuses an answer that lacks a member."""
import contextlib
import json
import pathlib
import subprocess
import sys
import tempfile
import time

import jsonschema


@contextlib.contextmanager
def served_chip(program: str):
    """The port of a virtual chip."""
    with tempfile.TemporaryDirectory() as folder:
        port = pathlib.Path(folder, "chip")
        server = subprocess.Popen([program, "chip", "serve", "--port", port], stdout=subprocess.DEVNULL)
        try:
            while not port.exists() and server.poll() is None:
                time.sleep(0.05)
            yield str(port)
        finally:
            server.terminate()
            server.wait()


def main() -> None:
    root, program = sys.argv[1:]
    schema = json.loads(pathlib.Path(root, "docs/start/answers.schema.json").read_text())
    jsonschema.Draft202012Validator.check_schema(schema)

    def judge(verb: str, *arguments: str) -> None:
        text = subprocess.run([program, *verb.split(), *arguments, "--json"], capture_output=True, text=True).stdout
        answer = json.loads(text)
        part = {"$ref": f"#/$defs/{verb}", "$defs": schema["$defs"]}
        jsonschema.validate(answer, part)
        first = answer[0] if isinstance(answer, list) else answer
        first.pop(next(iter(first)))
        try:
            jsonschema.validate(answer, part)
        except jsonschema.ValidationError:
            judged.add(verb)
            return
        sys.exit(f"{verb}: the schema takes an answer that lacks a member")

    judged: set[str] = set()
    judge("coordinates", f"{root}/examples/bumps.csv")
    judge("accuracy", f"{root}/examples/x_deviations.csv")
    judge("doctor")
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([program, "print", f"{root}/examples/first.toml", "--rtl", "none", "--out", f"{folder}/first"], capture_output=True)
        judge("report", f"{folder}/first", f"{folder}/first")
    with served_chip(program) as port:
        judge("chip read", "PV", "FAULT", "SETPOINT", "--port", port)
    described = json.loads(subprocess.run([program, "--describe"], capture_output=True, text=True).stdout)
    with_json = {c["command"] for c in described if any("--json" in option["names"] for option in c["options"])}
    if with_json != judged or set(schema["$defs"]) != judged:
        sys.exit(f"found --json at {sorted(with_json)}, in the schema {sorted(schema['$defs'])}, judged {sorted(judged)}; expected all equal")
    print(f"{len(judged)} answers are as the schema says")


if __name__ == "__main__":
    main()
