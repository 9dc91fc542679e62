#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""said_once.py ROOT: fails where a room types by hand what spec/ says: a list of the chip's pins, or a constant of cmodel/spec.hpp or rtl/tc_pkg.sv anew."""
import pathlib
import re
import sys
import tomllib

ROOMS = ("app", "asic", "bench", "cmodel", "fpga", "host", "rtl", "systemc", "tb", "tests/rtl", "tests/systemc", "tests/tb")
KINDS = {".cpp", ".hpp", ".inc", ".py", ".sh", ".sv", ".v", ".vh"}
NEAR_LINES = 20
MOST_PINS = 5  # pins that stand near each other and are no list yet
CONSTANT = re.compile(r"\b(k(?:Exc|Rsp|Seg|Fc|Format8|Status|Ctrl|Mode|St|Cmd|Fault|Pin|Sync)[A-Z0-9]\w*)\s*=\s*(?:0x|0b)?[0-9]")

# Not St: the states of a block of its own begin so too.
RTL_CONSTANT = re.compile(r"\b((?:Exc|Rsp|Seg|Fc|Format8|Status|Ctrl|Mode|Cmd|Fault|MaxRead|Mei|Broadcast|Identification)\w*)\s*=\s*[0-9]")
# A code beside a signal that has one, or the place of a field, as a bare number. No exception, 0, has no code.
RTL_NUMBER = re.compile(r"\b(?:segment|cmd_fc|rsp_kind|format)(?:_[a-z]+)?\s*[!=]=\s*[0-9]+'|\bexc(?:_[a-z]+)?\s*[!=]?=\s*[0-9]+'[dhb]0*[1-9A-F]"
                        r"|_exc(?:_[a-z]+)?\s*<?[!=]?=\s*[0-9]+'[dhb]0*[1-9A-F]|\bparams\w*\.(?:ctrl|mode|format)\[[0-9]|\bsens\w*\.(?:frame|data)\[[0-9]|\bstatus\w*\[[0-9]|\bstatus_i\(\{")
# The same in C++: a code beside what holds one, a bit or a word of a register that has fields, the word without a value, the clock. A list of
# words in braces is a draw of any.
VALUE = r"(?:0[xb][0-9a-fA-F]+|0*[1-9][0-9']*)\b"
CPP_NUMBER = re.compile(r"\b(?:cmd_fc\(\)|exception_code|rsp_exc_q|rsp_kind_q|segment_q)\s*[!=]=\s*" + VALUE +
                        r"|\bbit\(\s*(?:\w+::)*k(?:Reg|In)\w+,\s*[0-9]"
                        r"|\bkReg(?:Ctrl|Mode|Format)\b[\])]*\s*(?:,|=|&|>>)\s*" + VALUE +
                        r"|\bkReg(?:SensFrame|SensData)\b[\])]*\s*(?:&|>>)\s*" + VALUE +
                        r"|\b(?:d|preset)\.(?:frame|data)\s*(?:&|>>)\s*" + VALUE +
                        r"|\bkIn(?:Status|FirstFault|AtState)\b[\])]*\s*(?:&|>>)\s*" + VALUE +
                        r"|\bpv\w*\s*[!=]=\s*(?:INT16_MIN|-32768)|\b12(?:[_']?000[_']?000|e6)\b")


def pins_of(root):
    spec = tomllib.loads((root / "spec/chip.toml").read_text(encoding="utf-8"))
    return [pin["name"] for pin in spec["pin"]]


def constants_of(root):
    """Of the C++ and of the RTL."""
    return {*CONSTANT.findall((root / "cmodel/spec.hpp").read_text(encoding="utf-8")),
            *RTL_CONSTANT.findall((root / "rtl/tc_pkg.sv").read_text(encoding="utf-8"))}


def rtl_defects(lines, constants):
    for number, line in enumerate(lines, 1):
        code = line.split("//")[0]
        for name in RTL_CONSTANT.findall(code):
            if name in constants:
                yield number, f"found a value of {name}, expected tc_pkg::{name}"
        if bare := RTL_NUMBER.search(code):
            yield number, f"found {bare[0]}..., expected a name of tc_pkg"


def defects(path, pins, constants):
    lines = path.read_text(encoding="utf-8").splitlines()
    if path.suffix == ".sv":  # its ports have the pins' names of necessity
        yield from rtl_defects(lines, constants)
        return
    if path.suffix == ".v":  # nor is a connection by name a list: the tool that elaborates it holds it true
        lines = [re.sub(r"\.\w+\s*\(", "(", line) for line in lines]
    places = [(number, pin) for number, line in enumerate(lines, 1) for pin in re.findall(r"\b(?:" + "|".join(pins) + r")\b", line)]
    for first, _ in places:
        near = {pin for number, pin in places if first <= number < first + NEAR_LINES}
        if len(near) > MOST_PINS:
            yield first, f"found {len(near)} pins of the chip within {NEAR_LINES} lines, expected the lists of cmodel/pins.hpp"
            break
    comment = "#" if path.suffix in {".py", ".sh"} else "//"
    for number, line in enumerate(lines, 1):
        for name in CONSTANT.findall(line):
            if name in constants:
                yield number, f"found a value of {name}, expected spec::{name} of cmodel/spec.hpp"
        if bare := CPP_NUMBER.search(line.split(comment)[0]):
            yield number, f"found {bare[0]}, expected a name of cmodel/spec.hpp"


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
