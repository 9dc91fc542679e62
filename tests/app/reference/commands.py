#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""commands.py ROOT PROGRAM...: each command has an example that it would take, each verb stands in docs/start/commands.md, and what
`doctor` tells to install stands in packages.txt."""
import json
import pathlib
import re
import shlex
import subprocess
import sys


def output(*call: str) -> str:
    return subprocess.run(call, capture_output=True, text=True).stdout


def defects_of(command: dict, has_commands: bool) -> list[str]:
    name, example = command["command"], command["example"]
    if has_commands:
        return [] if not example else [f"{name}: an example of what needs another word"]
    if not example.startswith(f"meltstage {name}"):
        return [f"{name}: found the example '{example}', expected one that begins with meltstage {name}"]
    words = shlex.split(example)
    options = {given: option for option in command["options"] for given in option["names"]}
    given = [word.split("=")[0] for word in words if word.startswith("-")]
    defects = [f"{name}: its example has {word}, which is no option of it" for word in given if word not in options]
    defects += [f"{name}: its example lacks {option['names'][-1]}" for option in command["options"]
                if option["required"] and not set(option["names"]) & set(given)]
    values = sum(1 for word in given if options.get(word, {}).get("value") and f"{word}=" not in example)
    free = len(words) - 1 - len(name.split()) - len(given) - values
    wanted = sum(1 for argument in command["arguments"] if argument["required"])
    if free < wanted:
        defects.append(f"{name}: its example has {free} arguments, expected {wanted} at least")
    return defects


def main() -> None:
    root, *programs = sys.argv[1:]
    commands = {c["command"]: c for program in programs for c in json.loads(output(program, "--describe"))}
    defects = []
    for name, command in commands.items():
        defects += defects_of(command, any(other.startswith(name + " ") for other in commands))
    page = pathlib.Path(root, "docs/start/commands.md").read_text()
    told = set(re.findall(r"`meltstage ([a-z]+)", page)) | set(re.findall(r", `([a-z]+)`", page))
    defects += [f"docs/start/commands.md: lacks {name}" for name in commands if " " not in name and name not in told]
    known = set(re.findall(r"^([a-z0-9][a-z0-9.+-]+)", pathlib.Path(root, "packages.txt").read_text(), re.M))
    advice = json.loads(output(programs[0], "doctor", "--json"))
    bare = json.loads(subprocess.run([programs[0], "doctor", "--json"], env={"PATH": "/nowhere"}, capture_output=True, text=True).stdout)
    for finding in advice + bare:
        wanted = finding["advice"].removeprefix("apt-get install ")
        if finding["advice"].startswith("apt-get install ") and wanted not in known:
            defects.append(f"doctor: tells to install {wanted}, which packages.txt doesn't know")
    if not any(finding["state"] == "missing" for finding in bare):
        defects.append("doctor: misses nothing without a PATH")
    print("\n".join(defects) if defects else f"{len(commands)} commands are described")
    sys.exit(1 if defects else 0)


if __name__ == "__main__":
    main()
