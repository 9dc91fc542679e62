#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""cell_models.py LIBERTY FUNCTIONS.v > CELLS.v: Verilog of a library's cells with the paths that an SDF file gives delays to.

FUNCTIONS.v is what Yosys makes of the library (read_liberty, write_verilog): the logic. Each output gets a specify path from each pin that
the library has a delay from. Cells in FUNCTIONS.v that the library doesn't have are left out.
"""
import re
import sys


def paths_of_cells(text):
    """Cell to sorted (related pin, output pin), from the timing groups."""
    cells, stack = {}, []
    for token in re.finditer(r'(\w+)\s*\(([^(){};]*)\)\s*\{|\}|related_pin\s*:\s*"([^"]+)"', text):
        if token.group(0) == "}":
            stack.pop()
        elif token.group(3):
            cell, pin = [name for kind, name in stack if kind in ("cell", "pin")][:2]
            cells[cell].update((source, pin) for source in token.group(3).split())
        else:
            name = token.group(2).strip(' "')
            stack.append((token.group(1), name))
            if token.group(1) == "cell":
                cells[name] = set()
    return {cell: sorted(paths) for cell, paths in cells.items()}


def main(liberty, functions):
    with open(liberty, encoding="utf-8") as file:
        paths = paths_of_cells(re.sub(r"/\*.*?\*/", "", file.read(), flags=re.S))
    with open(functions, encoding="utf-8") as file:
        text = file.read()
    print("`timescale 1ns / 1ps")
    for module in re.finditer(r"^module (\S+?)\s*\(.*?^endmodule$", text, flags=re.M | re.S):
        outputs = set(re.findall(r"^\s*output (?:reg |wire |logic )?(\w+);", module.group(0), flags=re.M)) | set(re.findall(r"output (?:logic )?(\w+)[,)]", module.group(0)))
        lines = [f"    ({source} => {output}) = 0;\n" for source, output in paths.get(module.group(1), []) if output in outputs]
        if module.group(1) in paths:
            specify = "  specify\n" + "".join(lines) + "  endspecify\n" if lines else ""
            print(module.group(0)[:-len("endmodule")] + specify + "endmodule")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit("cell_models.py: expected LIBERTY FUNCTIONS.v")
    main(*sys.argv[1:])
