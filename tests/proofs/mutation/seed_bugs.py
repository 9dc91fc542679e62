#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""seed_bugs.py RTL_FOLDER BUGS OUT_FOLDER: a copy of the RTL in which input bug_i of tc_top chooses a bug, 0 none.

BUGS has a line a bug: file, expression, what stands in its place, description; tabs between. The expression must stand in the
file exactly once; it becomes (tc_top.bug_i == k ? broken : right).
"""
import pathlib
import sys

import variants


def main() -> int:
    rtl, bugs, out = map(pathlib.Path, sys.argv[1:4])
    text = variants.read(rtl)
    lines = [line for line in bugs.read_text().splitlines() if line and not line.startswith("#")]
    for number, line in enumerate(lines, 1):
        name, right, broken, _ = line.split("\t")
        found = text.get(name, "").count(right)
        if found != 1:
            print(f"{bugs}: bug {number}: {name}: expected '{right}' once, found {found} times; adapt the line to the RTL",
                  file=sys.stderr)
            return 1
        text[name] = text[name].replace(right, variants.choose(number, broken, right))
    variants.write(text, out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
