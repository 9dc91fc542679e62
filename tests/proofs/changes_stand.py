#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Every change on purpose, of each list that a proof or a run must refute, still finds its place in the sources. The lists themselves
are tried in long tests, a drawn one at a time in the quick ones; a row that has gone stale is told here at once.
Exit status: 0 good, 1 a row finds no place.
"""
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROOFS = ROOT / "tests" / "proofs"


def source(name: str) -> str:
    return next(path for room in ("rtl", "cmodel") for path in sorted((ROOT / room).rglob(name))).read_text(encoding="utf-8")


def rows(path: pathlib.Path):
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        if line and not line.startswith("#"):
            yield f"{path.relative_to(ROOT)}:{number}", line.split("\t")


def edits(expression: str, text: str) -> bool:
    return subprocess.run(["sed", expression], input=text, capture_output=True, text=True, check=True).stdout != text


def checks():
    """(place of a row, whether it finds its place), by the form of its list."""
    for path in [*sorted(PROOFS.glob("formal/*/bugs.txt")), PROOFS / "kernel" / "rtl_changes.txt"]:
        yield from ((place, edits(row[1], source(row[0]))) for place, row in rows(path))
    kernel = source("algor_kernel.hpp")
    yield from ((place, edits(row[0], kernel)) for place, row in rows(PROOFS / "kernel" / "kernel_changes.txt"))
    for path in (PROOFS / "mutation" / "bugs.tsv", ROOT / "tests" / "hls" / "model_changes.tsv"):
        yield from ((place, source(row[0]).count(row[1]) == 1) for place, row in rows(path))


def main() -> int:
    found = list(checks())
    stale = [place for place, stands in found if not stands]
    for place in stale:
        print(f"{place}: found no place for this change, expected one in the sources; give it the text that stands there now")
    print(f"{len(found)} changes, {len(stale)} without a place")
    return 1 if stale or not found else 0


sys.exit(main())
