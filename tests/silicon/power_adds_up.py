#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""power_adds_up.py POWER.py: asic/flow/power.py on a netlist small enough for a calculation by hand, with a flop that is clocked and one
whose clock stands still. Exit status 1 when it says something else."""
import json
import pathlib
import subprocess
import sys
import tempfile

LIBERTY = """library (l) {
  nom_voltage : 2;
  cell (INV) { cell_leakage_power : 1000;
    pin (A) { direction : "input"; capacitance : 0.004; }
    pin (Y) { direction : "output"; internal_power () { related_pin : "A";
      rise_power (t) { index_1 ("0.05, 0.15"); index_2 ("0.0, 0.01"); values ("0.001, 0.003", "0.003, 0.005"); }
      fall_power (t) { index_1 ("0.05, 0.15"); index_2 ("0.0, 0.01"); values ("0.003, 0.005", "0.005, 0.007"); } } } }
  cell (DFF) { cell_leakage_power : 2000; ff (IQ, IQN) { clocked_on : "CLK"; next_state : "D"; }
    pin (CLK) { direction : "input"; capacitance : 0.01; internal_power () { rise_power (s) { values ("0.02"); } fall_power (s) { values ("0.04"); } } }
    pin (D) { direction : "input"; capacitance : 0.002; }
    pin (Q) { direction : "output"; } }
}"""
CLOCKS, HZ = 100, 1e6
COUNTS = {"clk_i": 200, "still": 0, "d": 50, "q": 50, "y": 50, "p": 0}


def by_hand():
    """W. Per clock: the moving flop's clock pin twice 0.03 pJ; the inverter half a change, at a slew of 0.1 ns and 0.002 of 0.01 pF;
    half C V^2 on clk_i (0.01 pF), q (0.004) and y (0.002)."""
    flop = 2 * 0.03
    rise, fall = 0.002 + 0.2 * 0.002, 0.004 + 0.2 * 0.002
    inverter = 0.5 * (rise + fall) / 2
    wires = 0.5 * 4 * (2 * 0.01 + 0.5 * 0.004 + 0.5 * 0.002)
    return (flop + inverter + wires) * 1e-12 * HZ + 5000e-12


def main(power):
    bits = {name: k + 2 for k, name in enumerate(COUNTS)}
    def cell(kind, **pins):
        return {"type": kind, "connections": {pin: [bits[net]] for pin, net in pins.items()}}
    module = {"netnames": {name: {"bits": [bit]} for name, bit in bits.items()}, "ports": {"clk_i": {"bits": [bits["clk_i"]]}},
              "cells": {"f": cell("DFF", CLK="clk_i", D="y", Q="q"), "g": cell("DFF", CLK="still", D="d", Q="p"),
                        "i": cell("INV", A="q", Y="y")}}
    with tempfile.TemporaryDirectory() as folder:
        at = pathlib.Path(folder)
        (at / "l.lib").write_text(LIBERTY)
        (at / "n.json").write_text(json.dumps({"modules": {"top": module}}))
        (at / "c.dat").write_text("".join(f"C '\x01page\x02v_toggle/top\x01o\x02{n}\x01h\x02TOP' {c}\n" for n, c in COUNTS.items()))
        said = subprocess.run([power, at / "c.dat", str(CLOCKS), at / "n.json", "top", at / "l.lib", str(HZ)], text=True, capture_output=True, check=True)
    total = next(float(line.split()[1]) for line in said.stdout.splitlines() if line.startswith("Total"))
    print(said.stdout, f"by hand: {by_hand():.3e} W")
    return 0 if abs(total / by_hand() - 1) < 1e-3 and "50.0 % of the flops" in said.stdout else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
