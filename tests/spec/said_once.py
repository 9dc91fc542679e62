#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""said_once.py ROOT: fails where a room types by hand what spec/ says: a list of the chip's pins, or a constant of cmodel/spec.hpp anew."""
import pathlib
import re
import sys
import tomllib

ROOMS = ("app", "asic", "bench", "cmodel", "fpga", "host", "systemc", "tb", "tests/rtl", "tests/systemc", "tests/tb")
KINDS = {".cpp", ".hpp", ".inc", ".py", ".sh", ".v", ".vh"}
NEAR_LINES = 20
MOST_PINS = 5  # pins that stand near each other and are no list yet
CONSTANT = re.compile(r"\b(k(?:Exc|Rsp|Seg|Fc|Format8|Status|Ctrl|Mode|St|Cmd|Fault|Pin|Sync)[A-Z0-9]\w*)\s*=\s*(?:0x|0b)?[0-9]")


def pins_of(root):
    spec = tomllib.loads((root / "spec/chip.toml").read_text(encoding="utf-8"))
    return [pin["name"] for pin in spec["pin"]]


def constants_of(root):
    return set(CONSTANT.findall((root / "cmodel/spec.hpp").read_text(encoding="utf-8")))


def defects(path, pins, constants):
    lines = path.read_text(encoding="utf-8").splitlines()
    places = [(number, pin) for number, line in enumerate(lines, 1) for pin in re.findall(r"\b(?:" + "|".join(pins) + r")\b", line)]
    for first, _ in places:
        near = {pin for number, pin in places if first <= number < first + NEAR_LINES}
        if len(near) > MOST_PINS:
            yield first, f"found {len(near)} pins of the chip within {NEAR_LINES} lines, expected the lists of cmodel/pins.hpp"
            break
    for number, line in enumerate(lines, 1):
        for name in CONSTANT.findall(line):
            if name in constants:
                yield number, f"found a value of {name}, expected spec::{name} of cmodel/spec.hpp"


def main():
    root = pathlib.Path(sys.argv[1])
    pins, constants = pins_of(root), constants_of(root)
    found = looked = 0
    for room in ROOMS:
        for path in sorted((root / room).rglob("*")):
            name = path.relative_to(root)
            if path.suffix not in KINDS or "build" in name.parts or "Generated from spec/" in path.read_text(encoding="utf-8")[:200]:
                continue
            looked += 1
            for line, what in defects(path, pins, constants):
                print(f"{name}:{line}: {what}", file=sys.stderr)
                found += 1
    print(f"{looked} files, {found} copies of what spec/ says")
    return 1 if found or not looked else 0


if __name__ == "__main__":
    sys.exit(main())
