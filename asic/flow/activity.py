#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""activity.py COUNTS CLOCKS NETLIST.json TOP OUT.tcl: Verilator's toggle counts as OpenSTA's activities, on every pin of every cell.

An activity is the mean number of changes a clock. Exits with 1 when most pins have none. (OpenSTA of 2019 has a set_power_activity
that can't take pins; what it stands on can.)
"""
import json
import re
import sys

POINT = re.compile(r"\x01page\x02v_toggle/[^\x01]*\x01o\x02([^\x01]*)\x01.*' (\d+)$")
ESCAPED = re.compile(r"__0([0-9a-f]{2})")  # Verilator's way with characters that C++ doesn't allow


def main(counts, clocks, netlist, top, target):
    toggles = {}
    for line in open(counts, encoding="utf-8", errors="replace"):
        found = POINT.search(line.rstrip())
        if found:
            toggles[ESCAPED.sub(lambda code: chr(int(code.group(1), 16)), found.group(1))] = int(found.group(2))
    module = json.load(open(netlist, encoding="utf-8"))["modules"][top]
    name_of = {}
    for name, net in module["netnames"].items():
        if len(net["bits"]) == 1:
            name_of.setdefault(net["bits"][0], []).append(name)
    # flattening may have called a net after any pin on it
    for instance, cell in module["cells"].items():
        for pin, bits in cell["connections"].items():
            for bit in bits:
                name_of.setdefault(bit, []).append(f"{instance}.{pin}")
    written = missing = 0
    with open(target, "w", encoding="utf-8") as file:
        for instance, cell in module["cells"].items():
            for pin, bits in cell["connections"].items():
                count = next((toggles[name] for name in name_of.get(bits[0], []) if name in toggles), None)
                if count is None:
                    missing += 1
                    continue
                file.write(f"sta::set_power_pin_activity [get_pins {{{instance}/{pin}}}] {count / float(clocks):.6g} 0.5\n")
                written += 1
    print(f"{written} pins with an activity, {missing} without")
    return 0 if written > missing else 1


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
