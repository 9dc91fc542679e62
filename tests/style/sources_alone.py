#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""sources_alone.py BUILD [COUNT]: each C++ source that BUILD compiles together with others compiles by itself too, with clang as well.

A release build joins the sources of a room in one unit, in which a source can live on what another one includes or declares. clang sees
what gcc doesn't: a view of a text that is gone.
COUNT: so many of them, drawn at random; else all. Exit status: 0 good, 1 a source doesn't compile, 2 wrong use.
"""
import concurrent.futures
import json
import os
import pathlib
import random
import re
import shlex
import subprocess
import sys

JOINED = re.compile(r'^#include "(/.*\.cpp)"$', re.MULTILINE)


def joined_sources(build: pathlib.Path) -> list[tuple[str, list[str]]]:
    """Each source of a joint unit, with the compiler's call of that unit but for what it compiles and writes."""
    found = []
    for unit in json.loads((build / "compile_commands.json").read_text(encoding="utf-8")):
        if "/Unity/" not in unit["file"]:
            continue
        call = shlex.split(unit["command"])
        call = call[:call.index("-o")]
        sources = JOINED.findall(pathlib.Path(unit["file"]).read_text(encoding="utf-8"))
        found += [(source, call) for source in sources if not pathlib.Path(source).is_relative_to(build)]  # Verilator's are none of ours
    return found


def complaint(source: str, call: list[str]) -> str:
    own = next(i for i, word in enumerate(call) if not word.endswith("ccache"))
    for compiler in ([call[own]], ["clang++-14", "-Wno-unknown-warning-option"]):
        done = subprocess.run([*compiler, *call[own + 1:], "-fsyntax-only", source], capture_output=True, text=True, check=False)
        if done.returncode != 0:
            return done.stderr
    return ""


def main() -> int:
    if len(sys.argv) not in (2, 3):
        print(f"sources_alone.py: expected BUILD [COUNT], found {sys.argv[1:]}", file=sys.stderr)
        return 2
    sources = joined_sources(pathlib.Path(sys.argv[1]).resolve())
    if not sources:
        print(f"sources_alone.py: {sys.argv[1]}: found no joint units, expected a release build", file=sys.stderr)
        return 2
    if len(sys.argv) == 3:
        sources = random.sample(sources, int(sys.argv[2]))
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        complaints = list(pool.map(lambda one: complaint(*one), sources))
    for (source, _), text in zip(sources, complaints):
        print(f"{'FAILED ' if text else ''}{source}\n{text}", end="")
    bad = sum(map(bool, complaints))
    print(f"{len(sources)} sources by themselves, {bad} don't compile")
    return 1 if bad else 0


sys.exit(main())
