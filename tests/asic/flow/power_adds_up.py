#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""power_adds_up.py POWER.py: asic/flow/power.py on a netlist small enough for a calculation by hand, with a flop that is clocked, through
a buffer, and one whose clock stands still, without and with wires; a netlist that most counts are missing of is refused. Exit status 1 when it says something else."""
import collections
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
  cell (BUF) {
    pin (A) { direction : "input"; capacitance : 0.003; }
    pin (Y) { direction : "output"; function : "(A)"; internal_power () { rise_power (s) { values ("0.01"); } fall_power (s) { values ("0.03"); } } } }
  cell (DFF) { cell_leakage_power : 2000; ff (IQ, IQN) { clocked_on : "CLK"; next_state : "D"; }
    pin (CLK) { direction : "input"; capacitance : 0.01; internal_power () { rise_power (s) { values ("0.02"); } fall_power (s) { values ("0.04"); } } }
    pin (D) { direction : "input"; capacitance : 0.002; }
    pin (Q) { direction : "output"; } }
}"""
CLOCKS, HZ = 100, 1e6
COUNTS = {"clk_i": 200, "still": 0, "d": 50, "q": 50, "y": 50, "p": 0}  # none of the net behind the buffer: simulation merges it with clk_i
WIRES_PF = {"clk_i": 0.02, "leaf": 0.03, "q": 0.006, "d[0]": 1.0}


def by_hand(wire):
    """W. Per clock: the moving flop's clock pin twice 0.03 pJ; its buffer twice 0.02 pJ; the inverter half a change, at a slew of 0.1 ns and
    0.002 of 0.01 pF; half C V^2 on clk_i (0.003 pF), what is behind the buffer (0.01), q (0.004) and y (0.002), each with its wire."""
    flop, buffer = 2 * 0.03, 2 * 0.02
    rise, fall = 0.002 + 0.2 * 0.002, 0.004 + 0.2 * 0.002
    inverter = 0.5 * (rise + fall) / 2
    nets = 2 * (0.003 + wire["clk_i"]) + 2 * (0.01 + wire["leaf"]) + 0.5 * (0.004 + wire["q"]) + 0.5 * 0.002
    return (flop + buffer + inverter + 0.5 * 4 * nets) * 1e-12 * HZ + 5000e-12


def main(power):
    bits = {name: k + 2 for k, name in enumerate([*COUNTS, "leaf"])}
    def cell(kind, **pins):
        return {"type": kind, "connections": {pin: [bits[net]] for pin, net in pins.items()}}
    module = {"netnames": {name: {"bits": [bit]} for name, bit in bits.items()}, "ports": {"clk_i": {"bits": [bits["clk_i"]]}},
              "cells": {"b": cell("BUF", A="clk_i", Y="leaf"), "f": cell("DFF", CLK="leaf", D="y", Q="q"), "g": cell("DFF", CLK="still", D="d", Q="p"),
                        "i": cell("INV", A="q", Y="y")}}
    with tempfile.TemporaryDirectory() as folder:
        at = pathlib.Path(folder)
        (at / "l.lib").write_text(LIBERTY)
        (at / "n.json").write_text(json.dumps({"modules": {"top": module}}))
        (at / "w.spef").write_text("".join(f"*D_NET {name} {pf}\n".replace("[", "\\[").replace("]", "\\]") for name, pf in WIRES_PF.items()))
        def say(counts, *wires):
            (at / "c.dat").write_text("".join(f"C '\x01page\x02v_toggle/top\x01o\x02{n}\x01h\x02TOP' {c}\n" for n, c in counts.items()))
            return subprocess.run([power, at / "c.dat", str(CLOCKS), at / "n.json", "top", at / "l.lib", str(HZ), *wires], text=True, capture_output=True, check=False)
        runs = [(say(COUNTS), by_hand(collections.Counter())), (say(COUNTS, at / "w.spef"), by_hand(WIRES_PF))]
        refused = say({"clk_i": 200}).returncode == 1
    wrong = 0
    for said, wanted in runs:
        total = next(float(line.split()[1]) for line in said.stdout.splitlines() if line.startswith("Total"))
        print(said.stdout, f"by hand: {wanted:.3e} W")
        wrong += abs(total / wanted - 1) > 1e-3 or "50.0 % of the flops" not in said.stdout or said.returncode != 0
    return 0 if wrong == 0 and refused else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
