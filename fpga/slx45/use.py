#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""use.py CELLS.txt: what of a Spartan-6 XC6SLX45 the netlist takes. Device figures: Xilinx DS160, table 1."""
import re
import sys

HAS = {"LUT6": 27288, "flops": 54576, "DSP48A1": 58, "RAM of 18 kbit": 116}

cells = {kind: int(count) for kind, count in re.findall(r"^ +([A-Z]\w+) +(\d+)$", open(sys.argv[1], encoding="utf-8").read(), re.M)}
used = {"LUT6": sum(n for kind, n in cells.items() if re.fullmatch(r"LUT\d|INV", kind)),
        "flops": sum(n for kind, n in cells.items() if re.fullmatch(r"FD\w+", kind)),
        "DSP48A1": cells.get("DSP48A1", 0), "RAM of 18 kbit": cells.get("RAMB16BWER", 0)}
for what, count in used.items():
    print(f"{what:<16} {count:>6} of {HAS[what]:>6}  {100 * count / HAS[what]:5.1f} %")
