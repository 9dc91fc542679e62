#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""features.py OUT.json: the area of each safety feature, by synthesising its block without it.

A feature is taken out of a copy of the RTL by substitutions; the difference in area is what it costs. RTL, LIBERTY, CLOCK_GATE_MAP and BUFFER
come from the environment, as for synth.tcl. Exits with 2 when a substitution no longer finds its line.
"""
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
FEATURES = [
    ("check bits of parameters and their scrubbing", "tc_mem", [
        ("tc_math_pkg.sv", r"(secded_check|secded_flip\[(?:16\+)?i\]) =[^;]*;", r"\1 = '0;"),
        ("tc_math_pkg.sv", r"\{5'd0, \^data, data\}", "{6'd0, data}"),
        ("tc_mem.sv", r"(stored_row = )(tc_pkg::reg_stored\(index\));", r"\1index == ColumnsIndex ? 22'd0 : \2 & 22'h00FFFF;"),
        ("tc_mem.sv", r"(syndrome_q|odd_row_q|odd_rows_q)( +<= )(syndrome_q \^ row|scrub_index_q|1'b1);", r"\1\2'0;")]),
    ("second flop of the heater's permission", "tc_guard", [("tc_guard.sv", r"(assign rails_differ =)[^;]*;", r"\1 1'b0;")]),
    ("parity of long-lived flops", "tc_guard", [("tc_guard.sv", r"(assign upset +=)[^;]*;", r"\1 1'b0;")]),
]


def stop(text):
    print(f"features.py: {text}", file=sys.stderr)
    sys.exit(2)


def area_um2(rtl, top, folder):
    environment = dict(os.environ, SOURCES=str(rtl / "tc.f"), TOP=top, SCANNER="")  # blocks have no scan
    done = subprocess.run(["yosys", "-q", "-c", str(HERE / "synth.tcl")], cwd=folder, env=environment, capture_output=True, text=True,
                          check=False)
    if done.returncode:
        stop(f"{top}: Yosys stopped: {(done.stderr or done.stdout).strip().splitlines()[-1]}")
    return float(re.search(r"Chip area for module .*: ([\d.]+)", (folder / "area.txt").read_text()).group(1))


def features(rtl):
    guard = (rtl / "tc_guard.sv").read_text()
    for cause in re.findall(r"cause_d\[tc_pkg::Fault(\w+)\] *=", guard):
        yield f"detector {cause}", "tc_guard", [("tc_guard.sv", rf"(cause_d\[tc_pkg::Fault{cause}\] *=)[^;]*;", r"\1 1'b0;")]
    yield from FEATURES


def main(target):
    rtl = pathlib.Path(os.environ["RTL"])
    whole, rows = {}, []
    for name, block, changes in features(rtl):
        with tempfile.TemporaryDirectory() as work:
            folder = pathlib.Path(work)
            if block not in whole:
                whole[block] = area_um2(rtl, block, folder)
            without = folder / "rtl"
            shutil.copytree(rtl, without)
            for file, pattern, replacement in changes:
                text, count = re.subn(pattern, replacement, (without / file).read_text())
                if count == 0:
                    stop(f"{name}: {pattern} is not in {file}; mend this feature's substitution")
                (without / file).write_text(text)
            rows.append({"feature": name, "block": block, "area_um2": whole[block] - area_um2(without, block, folder)})
    part = pathlib.Path(target + ".part")
    part.write_text(json.dumps({"blocks": whole, "features": rows}, indent=1))
    part.rename(target)


if __name__ == "__main__":
    main(sys.argv[1])
