#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""activity.py COUNTS CLOCKS NETLIST.json TOP OUT.tcl: Verilator's toggle counts as OpenSTA's activities, one driving pin a net.

An activity is the mean number of changes a clock. A net without a count (none that is left) gets none.
"""
import json
import re
import sys

POINT = re.compile(r"\x01page\x02v_toggle/[^\x01]*\x01o\x02([^\x01]*)\x01.*' (\d+)$")
OUTPUTS = {"Q", "X", "Y", "GCLK", "L_HI", "L_LO", "Q_N"}


def main(counts, clocks, netlist, top, target):
    toggles = {}
    for line in open(counts, encoding="utf-8", errors="replace"):
        found = POINT.search(line.rstrip())
        if found:
            toggles[found.group(1)] = int(found.group(2))
    module = json.load(open(netlist, encoding="utf-8"))["modules"][top]
    name_of = {}
    for name, net in module["netnames"].items():
        if len(net["bits"]) == 1:
            name_of.setdefault(net["bits"][0], []).append(name)
    written = missing = 0
    with open(target, "w", encoding="utf-8") as file:
        for instance, cell in module["cells"].items():
            for pin, bits in cell["connections"].items():
                if pin not in OUTPUTS or not bits:
                    continue
                count = next((toggles[name] for name in name_of.get(bits[0], []) if name in toggles), None)
                if count is None:
                    missing += 1
                    continue
                file.write(f"set_power_activity -pins [get_pins {{{instance}/{pin}}}] -activity {count / float(clocks):.6g} -duty 0.5\n")
                written += 1
    print(f"{written} nets with an activity, {missing} without")
    return 0 if written > missing else 1


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
