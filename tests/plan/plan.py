#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""plan.py BUILD_FOLDER MELTSTAGE [--requirements FILE] [--write]: the verification plan, spec/requirements.toml, against what there is.

Tests are those of ctest in BUILD_FOLDER, properties the assertions of the RTL and the harnesses, points what MELTSTAGE's
`regress points` prints. Fails on a name that stands for nothing, a requirement that nothing measures, and a point or safety
property that is in no requirement. --write makes docs/verify/plan.md, else the page must be as it would be made.
Exit status: 0 as it should be, 1 not, 2 wrong call.
"""
import argparse
import fnmatch
import json
import pathlib
import re
import subprocess
import sys
import tomllib

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs/verify/plan.md"
KINDS = ("tests", "properties", "points")


def tests_of(build: pathlib.Path) -> set[str]:
    listed = subprocess.run(["ctest", "--test-dir", build, "--show-only=json-v1"], capture_output=True, text=True, check=True).stdout
    return {test["name"] for test in json.loads(listed)["tests"]}


def properties() -> set[str]:
    found = set()
    for folder in (ROOT / "rtl", ROOT / "tests/proofs/formal"):
        for path in folder.rglob("*.sv"):
            found.update(re.findall(r"`TC_ASSERT\w*\((\w+_A)\b|^\s*(\w+_A): assert", path.read_text(), re.MULTILINE))
    return {name for pair in found for name in pair if name}


def points(meltstage: str) -> set[str]:
    return set(subprocess.run([meltstage, "regress", "points"], capture_output=True, text=True, check=True).stdout.splitlines())


def matches(pattern: str, names: set[str]) -> set[str]:
    return {name for name in names if fnmatch.fnmatchcase(name, pattern)}


def complaints(requirements: list[dict], there: dict[str, set[str]]) -> list[str]:
    said = []
    used: dict[str, set[str]] = {kind: set() for kind in KINDS}
    ids = [requirement["id"] for requirement in requirements]
    said += [f"{id}: found it twice, expected each requirement once" for id in sorted(set(ids)) if ids.count(id) > 1]
    for requirement in requirements:
        for kind in KINDS:
            for pattern in requirement.get(kind, []):
                found = matches(pattern, there[kind])
                if not found:
                    said.append(f"{requirement['id']}: found no {kind} {pattern}, expected one at least")
                used[kind] |= found
        if not requirement.get("tests"):
            said.append(f"{requirement['id']}: found no tests, expected some")
        if not requirement.get("properties") and not requirement.get("points"):
            said.append(f"{requirement['id']}: found neither properties nor points, expected one of both")
    said += [f"point {name}: found it in no requirement, expected one" for name in sorted(there["points"] - used["points"])]
    safety = {name for name in there["properties"] if re.match(r"P\d\d_", name)}
    said += [f"property {name}: found it in no requirement, expected one" for name in sorted(safety - used["properties"])]
    return said


def page(requirements: list[dict], there: dict[str, set[str]]) -> str:
    rows = []
    for requirement in requirements:
        cells = [requirement["id"], requirement["says"]]
        for kind in KINDS:
            patterns = requirement.get(kind, [])
            names = set().union(*(matches(pattern, there[kind]) for pattern in patterns)) if patterns else set()
            count = "" if kind == "tests" else f"{len(names)}: "  # each new test would be another page
            cells.append(count + ", ".join(f"`{pattern}`" for pattern in patterns) if patterns else "-")
        rows.append("| " + " | ".join(cells) + " |")
    return f"""# What the chip promises, and what shows it

This page is made of `spec/requirements.toml` by `tests/plan/plan.py`. A test fails when it is not. It also fails when

- a name here stands for nothing,
- nothing measures a requirement,
- a point of coverage or a safety property is in no requirement.

Tests are those of `./check` and `./check full`. Properties are assertions of the RTL, alive in each simulation and proved for all
inputs ([properties.md](properties.md)). Points of coverage are met by each run of the suites `pr`, `nightly` and `release`, or the
suite fails ([regress.md](regress.md)). Numbers say for how many properties and points the names stand.

| | requirement | tests | properties | points |
|---|---|---|---|---|
{chr(10).join(rows)}

{len(requirements)} requirements, {len(there["points"])} points of coverage.
"""


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("meltstage")
    parser.add_argument("--requirements", type=pathlib.Path, default=ROOT / "spec/requirements.toml")
    parser.add_argument("--write", action="store_true")
    asked = parser.parse_args()
    requirements = tomllib.loads(asked.requirements.read_text())["requirement"]
    there = {"tests": tests_of(asked.build), "properties": properties(), "points": points(asked.meltstage)}
    said = complaints(requirements, there)
    made = page(requirements, there)
    if asked.write and not said:
        PAGE.write_text(made)
    elif not said and (not PAGE.exists() or PAGE.read_text() != made):
        said.append(f"{PAGE.relative_to(ROOT)}: found it older than spec/requirements.toml and what is there; make it by --write")
    for line in said:
        print(f"{asked.requirements.name}: {line}" if not line.startswith("docs") else line, file=sys.stderr)
    return 1 if said else 0


if __name__ == "__main__":
    sys.exit(main())
