#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Writes every file derived from spec/*.toml; with --check, fails on a derived file that is stale instead.

Usage: generate.py [--check] [--out DIR] [--built DIR] [--writable NAME,NAME...]
DIR: project root, default the parent of this file's folder
NAMEs: a smaller chip for a small device: the other holding registers stand at their reset values for good
"""
import argparse
import functools
import json
import math
import operator
import pathlib
import re
import sys
import tomllib
from fractions import Fraction

import jinja2

sys.dont_write_bytecode = True  # the module beside this one leaves nothing in the source tree
from shapes import (RESERVED, SpecError, camel, check_characters, check_counts, check_faults, check_pins, check_presets, check_shapes, check_states, defect, is_text,
                    is_whole, member_of, shown)

SPEC = pathlib.Path(__file__).resolve().parent
SECDED_DATA_BITS = 16
SECDED_CHECK_BITS = 6
REGISTER_KEYS = ("name", "unit", "scale", "type")
HOLDING_KEYS = ("min", "max", "reset", "access")
OTHER_KEYS = {"input": ("doc", "bits", "fields", "none"), "holding": ("doc", "bits", "fields", "corrected")}
FIELD_KEYS = ("name", "bit", "width", "doc")
ACCESSES = ("rw", "wo")
RANGES = {"u": (0, 65535), "s": (-32768, 32767)}
NAME = re.compile("[A-Z][A-Z0-9]*(_[A-Z0-9]+)*")  # what SystemVerilog, C++ and a host's command line take
BIT_NAME = re.compile("[A-Za-z][A-Za-z0-9]*([ _][A-Za-z0-9]+)*")
SCALE = re.compile(r"2\^-?[0-9]{1,2}|[0-9]{1,9}(\.[0-9]{1,9})?|[0-9]{1,9}/0*[1-9][0-9]{0,8}")
# An index has 6 bits. Of holding registers, MEM keeps one value for its row of column parities, and one for "behind all rows".
MOST_REGISTERS = {"input": 64, "holding": 62}

# template -> file written, relative to the project root
OUTPUTS = {
    "tc_pkg.sv.j2": "rtl/tc_pkg.sv",
    "spec.hpp.j2": "cmodel/spec.hpp",
    "pins.hpp.j2": "cmodel/pins.hpp",
    "fault_advice.hpp.j2": "cmodel/fault_advice.hpp",
    "registers.md.j2": "docs/chip/registers.md",
    "modbus_map.csv.j2": "docs/host/modbus_map.csv",
    "modbus_map.json.j2": "docs/host/modbus_map.json",
}

# template -> file that a build writes for a tool, and nobody reads
BUILT = {
    "replay_pins.vh.j2": "replay_pins.vh",
}


def scale_value(text: str) -> float:
    if text.startswith("2^"):
        return float(Fraction(2) ** int(text[2:]))
    return float(Fraction(text))


def crc16_modbus(data: bytes) -> int:
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ (0xA001 if crc & 1 else 0)
    return crc


def hsiao_columns() -> list[int]:
    """Odd-weight columns of the (22,16) Hsiao code: 16 of the 20 six-bit words of weight three."""
    return [word for word in range(64) if bin(word).count("1") == 3][:SECDED_DATA_BITS]


def code_words(columns: list[int]) -> list[int]:
    """Of each data word its code word, check bits above the data: those of columns[i] change with data bit i."""
    words = [0]
    for bit, column in enumerate(columns):
        words += [word ^ (column << SECDED_DATA_BITS | 1 << bit) for word in words]
    return words


def stored_bits(words: list[int], low: int, high: int) -> int:
    """Mask of the bits that differ among the code words of low..high."""
    codes = [words[value & 0xFFFF] for value in range(low, high + 1)]
    return functools.reduce(operator.or_, codes) & ~functools.reduce(operator.and_, codes)


def found(reg: dict, what: str, expected: str) -> SpecError:
    return SpecError(f"registers.toml: {reg['name']}: found {what}, expected {expected}")


def check_word(reg: dict, name: str) -> None:
    """No language keeps it for itself."""
    for language, words in RESERVED.items():
        if name.lower() in words:
            raise found(reg, f"{name}, a word of {language}", "a name that no language takes for itself, such as HEAD_ID")


def check_keys(reg: dict, wanted: tuple[str, ...], known: tuple[str, ...]) -> None:
    for key in wanted:
        if key not in reg:
            raise found(reg, f"no {key}", ", ".join(wanted))
    for key in reg:
        if key not in known:
            raise found(reg, f"{shown(key)}, which nothing reads", f"one of {', '.join(known)}")


def check_numbers(reg: dict, keys: list[str]) -> None:
    """Whole numbers that a word of the register's type can hold."""
    low, high = RANGES[reg["type"]]
    for key in keys:
        if not is_whole(reg[key]) or not low <= reg[key] <= high:
            raise found(reg, f"{key} {shown(reg[key])}", f"a whole number from {low} to {high}, as its type is {reg['type']}")


def check_fields(reg: dict) -> None:
    fields = reg.get("fields", [])
    if not isinstance(fields, list) or not all(isinstance(field, dict) and isinstance(field.get("name"), str) for field in fields):
        raise found(reg, "fields that are no list of parts with names", 'such as [{ name = "PAUSE", bit = 2 }]')
    names = [field["name"] for field in fields]
    for field in fields:
        if not NAME.fullmatch(field["name"]):
            raise found(reg, f"a field {shown(field['name'])}", "a name such as HEAT_RATE")
        if names.count(field["name"]) > 1:
            raise found(reg, f"field {field['name']} twice", "each name once")
        for key in field:
            if key not in FIELD_KEYS:
                raise found(reg, f"{shown(key)} of field {field['name']}, which nothing reads", f"one of {', '.join(FIELD_KEYS)}")
        bit, width = field.get("bit"), field.get("width", 1)
        if not is_whole(bit) or not is_whole(width) or bit < 0 or width < 1 or bit + width > 16:
            raise found(reg, f"field {field['name']} with bit {shown(bit)}, width {shown(width)}", "a part of the bits 0 to 15")
        if not is_text(field.get("doc", "")):
            raise found(reg, f"a doc of field {field['name']} that no table takes", 'one line without |, \\ and "')


def check_texts(reg: dict) -> None:
    for key in ("unit", "doc"):
        if not is_text(reg.get(key, "")):
            raise found(reg, f"a {key} that no table takes", 'one line without |, \\ and "')
    if "," in reg["unit"]:
        raise found(reg, f"unit {shown(reg['unit'])}", "one without a comma")
    bits = reg.get("bits", [])
    if not isinstance(bits, list) or not all(isinstance(name, str) and BIT_NAME.fullmatch(name) for name in bits) or len(bits) > 16:
        raise found(reg, "bits that are no names", "at most 16, each of words such as ramp active")
    for name in bits:
        check_word(reg, name.replace(" ", "_"))
    if not any(reg.get(key) for key in ("doc", "bits", "fields")):
        raise found(reg, "no doc", "a text that says what it is for")


def check_entries(space: str, registers: list[dict]) -> None:
    """Each register is one that every reader of it takes, or one line names it, and what was found and expected."""
    wanted = REGISTER_KEYS + (HOLDING_KEYS if space == "holding" else ())
    for index, reg in enumerate(registers):
        if "name" not in reg:
            raise SpecError(f"registers.toml: [[{space}]] number {index + 1}: found no name, expected {', '.join(wanted)}")
        if not isinstance(reg["name"], str) or not NAME.fullmatch(reg["name"]):
            raise SpecError(f"registers.toml: {shown(reg['name'])}: found a name that no language takes, expected one such as HEAD_ID")
        check_word(reg, reg["name"])
        check_keys(reg, wanted, wanted + OTHER_KEYS[space])
        if reg.get("access", "rw") not in ACCESSES:
            raise found(reg, f"access {shown(reg['access'])}", " or ".join(ACCESSES))
        if reg["type"] not in [*RANGES]:
            raise found(reg, f"type {shown(reg['type'])}", "u (unsigned) or s (two's complement)")
        if not isinstance(reg["scale"], str) or not SCALE.fullmatch(reg["scale"]) or not scale_value(reg["scale"]) > 0:
            raise found(reg, f"scale {shown(reg['scale'])}", 'a text of a number above 0, such as "0.1", "4/3" or "2^-6"')
        check_texts(reg)
        check_fields(reg)
        if not isinstance(reg.get("corrected", False), bool):
            raise found(reg, f"corrected {shown(reg['corrected'])}", "true or false")
        check_numbers(reg, [key for key in ("min", "max", "reset", "none") if key in reg])
        if space == "holding" and reg["min"] > reg["max"]:
            raise found(reg, f"min {reg['min']} above max {reg['max']}", "a range")
        if space == "holding" and not reg["min"] <= reg["reset"] <= reg["max"]:
            raise found(reg, f"reset {reg['reset']}", f"a value from {reg['min']} to {reg['max']}")


def check_count(space: str, registers: list[dict]) -> None:
    most = MOST_REGISTERS[space]
    if len(registers) > most:
        raise SpecError(f"registers.toml: found {len(registers)} [[{space}]] registers, expected at most {most}: MEM's index has 6 bits")


def check_names_differ(registers: list[dict]) -> None:
    """A host names a register without its space, and A_1 and A1 would be one constant."""
    known = {}
    for reg in registers:
        key = camel(reg["name"])
        if key in known:
            spellings = "" if known[key] == reg["name"] else f"as {known[key]} and {reg['name']}, "
            raise SpecError(f"registers.toml: {reg['name']}: found twice, {spellings}expected each name once")
        known[key] = reg["name"]


def finish_fields(reg: dict) -> None:
    """Each field's width and bits outside of which nothing may lie; the register's doc where it has none of its own."""
    fields = reg.setdefault("fields", [])
    taken = 0
    for field in fields:
        field.setdefault("width", 1)
        mask = (1 << field["width"]) - 1 << field["bit"]
        if taken & mask:
            raise found(reg, f"field {field['name']} on bits of another one", "bits of its own")
        taken |= mask
    if "doc" not in reg:
        texts = (f"{f['bit']} {f['name']}" + (f" ({f['doc']})" if "doc" in f else "") for f in fields)
        reg["doc"] = "Bit " + ", ".join(texts) + "."


def finish_registers(spec: dict) -> None:
    for space in MOST_REGISTERS:
        if not isinstance(spec.get(space), list) or not all(isinstance(reg, dict) for reg in spec[space]):
            raise SpecError(f"registers.toml: found no [[{space}]], expected registers")
    for space, base in (("input", 0), ("holding", spec["modbus"]["holding_base"])):
        check_entries(space, spec[space])
        check_count(space, spec[space])
        for index, reg in enumerate(spec[space]):
            reg["index"] = index
            reg["addr"] = base + index
            reg["camel"] = camel(reg["name"])
            reg["scale_value"] = scale_value(reg["scale"])
            reg["signed"] = reg["type"] == "s"
            if "bits" in reg:
                reg["doc"] = "Bits: " + ", ".join(f"{i} {name}" for i, name in enumerate(reg["bits"])) + "."
            finish_fields(reg)
    check_names_differ(spec["input"] + spec["holding"])
    if not any(reg["name"] == "STATUS" and "bits" in reg for reg in spec["input"]):
        raise SpecError("registers.toml: found no [[input]] STATUS with bits, expected it: the chip tells its state there")
    if spec["holding"][0]["name"] != "CMD":
        raise found(spec["holding"][0], "it as the first [[holding]]", "CMD there; a new register goes to the end")
    with_parity, with_secded = code_words([1] * SECDED_DATA_BITS), code_words(hsiao_columns())
    for reg in spec["holding"]:
        reg["corrected"] = reg.get("corrected", False)
        words = with_secded if reg["corrected"] else with_parity
        reg["stored"] = stored_bits(words, reg["min"], reg["max"]) if reg["index"] else 0
        reg["min_word"], reg["max_word"], reg["reset_word"] = (reg[k] & 0xFFFF for k in ("min", "max", "reset"))


def check_constants_differ(spec: dict, package: str) -> None:
    """TUNE with a field CYCLES would make the constant TuneCycles, which is one of the autotune."""
    names = re.findall(r"^  localparam .*?(\w+) = ", package, re.MULTILINE)
    for reg in spec["input"] + spec["holding"]:
        own = [reg["camel"] + camel(field["name"]) + end for field in reg["fields"] for end in ("", "Width")]
        for name in (*own, reg["camel"] + "None"):
            if names.count(name) > 1:
                raise found(reg, f"the constant {name} twice in the RTL's package", "another name of the register or its field")
    for name in names:
        if names.count(name) > 1:
            raise SpecError(f"chip.toml: found an entry that makes the constant {name} twice in the RTL's package, expected another name of it")


def fix_all_but(writable: list[str], holding: list[dict]) -> None:
    """Leaves registers other than these and the command word one value, that of reset. The map stays what it is, and so does its CRC."""
    names = [reg["name"] for reg in holding]
    for name in writable:
        if name not in names:
            raise SpecError(f"--writable: found {name}, expected names of holding registers (docs/chip/registers.md)")
    for reg in holding:
        if reg["name"] not in (*writable, "CMD"):
            reg["min"] = reg["max"] = reg["reset"]
            reg["min_word"] = reg["max_word"] = reg["reset_word"]
            reg["stored"] = 0


def finish_pins(spec: dict) -> None:
    """Of each pin its direction, its name in C++ (uart_rx_i -> uart_rx, fault_no -> fault_n) and its lowest bit in the synchroniser."""
    synchronised = 0
    for pin in (*spec["pin"], *spec["test_pin"]):
        pin["member"] = member_of(pin["name"])
        pin["output"] = pin["name"].endswith("o")
        pin["width"] = spec["chip"].get(pin.get("width"), pin.get("width", 1))
        pin.setdefault("idle", 0)
        pin.setdefault("modelled", pin in spec["pin"])
        if pin.setdefault("async", False):
            pin["sync_bit"] = synchronised
            synchronised += pin["width"]
    spec["model_inputs"] = [p for p in (*spec["pin"], *(p for p in spec["test_pin"] if p["modelled"])) if not p["output"]]
    spec["model_outputs"] = [p for p in spec["pin"] if p["output"]]


def finish_presets(spec: dict) -> None:
    for p in spec["preset"]:
        p["frame_word"] = p["length"] | p["mode"] << 6 | p["lsb"] << 8 | int(p["signed"]) << 13
        p["data_word"] = p["width"] | p["tx"] << 8
        p["offset_word"] = p["offset"] & 0xFFFF


def ident_rom(spec: dict) -> dict:
    """Bytes of FC 17 and FC 43/14 answers, with the place and length of each part."""
    chip = spec["chip"]
    rom = bytearray()
    parts = []
    for text in (chip["server_id"], chip["vendor"], chip["product"], chip["revision"]):
        parts.append({"start": len(rom), "length": len(text)})
        rom += text.encode("ascii")
    return {"bytes": list(rom), "server_id": parts[0], "objects": parts[1:]}


def finish_autotune(spec: dict) -> None:
    """Integer factors of the autotune rule; KU, KP in 2^-16 duty per degC, sums over the measured cycles."""
    tune = spec["autotune"]
    cycles = tune["measure_cycles"]
    # KU = 4 h / (pi a): h half of the relay's step, a half of the mean swing in 1/64 degC.
    ku = 64 * 4 / math.pi * cycles
    tune["ku_factor"] = round(ku)
    tune["kp_factor"] = round(ku * tune["kp"])
    # KI in UQ2.14 per control period, KD in UQ13.3 on a temperature in 1/1024 degC.
    tune["ki_approach_factor"] = round(256 * cycles / tune["ti_approach"])
    tune["ki_hold_factor"] = round(256 * cycles / tune["ti_hold"])
    tune["kd_divisor"] = round(8 * cycles / tune["td"])
    for key in ("ku_factor", "kp_factor", "ki_approach_factor", "ki_hold_factor", "kd_divisor"):
        if not 0 < tune[key] < 1 << 18:
            raise defect("chip.toml", "[autotune]", f"what makes {key} {tune[key]}", "one above 0 of 18 bits: other kp, td, ti_approach or ti_hold")


def map_rows(spec: dict) -> list[dict]:
    rows = []
    for reg in spec["input"]:
        rows.append({"name": reg["name"], "space": "input", "address": reg["addr"], "type": "int16" if reg["signed"] else "uint16",
                     "unit": reg["unit"], "scale": reg["scale_value"], "access": "ro", "doc": reg["doc"]})
    for reg in spec["holding"]:
        rows.append({"name": reg["name"], "space": "holding", "address": reg["addr"], "type": "int16" if reg["signed"] else "uint16",
                     "unit": reg["unit"], "scale": reg["scale_value"], "access": reg["access"],
                     "min": reg["min"], "max": reg["max"], "reset": reg["reset"], "doc": reg["doc"]})
    return rows


def tables_of(file: str) -> dict:
    try:
        tables = tomllib.loads((SPEC / file).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:  # UnicodeDecodeError and TOMLDecodeError are ValueErrors
        raise SpecError(f"{file}: found {shown(error)}, expected a TOML file") from error
    if file == "registers.toml":
        for name in tables:
            if name not in MOST_REGISTERS:
                raise SpecError(f"{file}: found {shown(name)}, which nothing reads, expected [[input]] and [[holding]]")
    else:
        check_shapes(file, tables)
    return tables


def load() -> dict:
    spec = {}
    for name in ("chip", "registers", "presets"):
        spec |= tables_of(f"{name}.toml")
    finish_registers(spec)
    check_pins(spec)
    check_states(spec["state"])
    check_characters(spec["character"])
    check_faults(spec)
    check_counts(spec)
    check_presets(spec["preset"])
    finish_presets(spec)
    finish_pins(spec)
    finish_autotune(spec)
    spec["status_bits"] = next(reg["bits"] for reg in spec["input"] if reg["name"] == "STATUS")
    spec["ident"] = ident_rom(spec)
    spec["map_rows"] = map_rows(spec)
    spec["map_crc"] = crc16_modbus(json.dumps(spec["map_rows"], sort_keys=True).encode())
    spec["secded_columns"] = hsiao_columns()
    spec["secded_rows"] = [sum(1 << bit for bit, col in enumerate(spec["secded_columns"]) if col >> row & 1) for row in range(SECDED_CHECK_BITS)]
    return spec


def render(spec: dict, outputs: dict[str, str]) -> dict[str, str]:
    env = jinja2.Environment(loader=jinja2.FileSystemLoader(SPEC / "templates"), undefined=jinja2.StrictUndefined,
                             trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True)
    env.filters["camel"] = camel
    return {target: env.get_template(template).render(**spec) for template, target in outputs.items()}


def is_same(file: pathlib.Path, text: str) -> bool:
    return file.is_file() and file.read_bytes() == text.encode()


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="write nothing; fail on a stale file")
    parser.add_argument("--writable", help="holding registers that a host can write, with commas; default all")
    parser.add_argument("--out", type=pathlib.Path, default=SPEC.parent, help="project root to write into")
    parser.add_argument("--built", type=pathlib.Path, help="folder of a build: write what its tools need there, and nothing else")
    args = parser.parse_args()
    root, outputs = (args.built, BUILT) if args.built else (args.out, OUTPUTS)
    try:
        spec = load()
        if args.writable is not None:
            fix_all_but(args.writable.split(","), spec["holding"])
        spec["columns_stored"] = functools.reduce(operator.or_, (reg["stored"] for reg in spec["holding"]))
        files = render(spec, outputs)
        if not args.built:
            check_constants_differ(spec, files["rtl/tc_pkg.sv"])
    except (SpecError, jinja2.TemplateError) as error:
        print(f"generate.py: {error}", file=sys.stderr)
        return 2
    stale = [name for name, text in files.items() if not is_same(root / name, text)]
    if args.check:
        for name in stale:
            print(f"{name}: stale, differs from what spec/*.toml give; run spec/generate.py and commit", file=sys.stderr)
        return 1 if stale else 0
    try:
        for name in stale:
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            (root / name).write_text(files[name], encoding="utf-8")
    except OSError as error:
        print(f"generate.py: {error.filename}: found {error.strerror}, expected a place to write into; choose another folder", file=sys.stderr)
        return 2
    if not args.built:
        print("; ".join(f"{space} registers: {len(spec[space])} of {most} places taken" for space, most in MOST_REGISTERS.items()))
    return 0


if __name__ == "__main__":
    sys.exit(main())
