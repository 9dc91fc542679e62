#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""cells.py LIBERTY BY_HAND.v GENERATED.v: the area of the chip by hand and of the generated one, block by block, as a table.

Both are netlists of the library's cells that Yosys has mapped (asic/flow). A block has its flops with their clock gates, and the logic that
feeds them and no other block's. What feeds several blocks, or pins, has a row of its own: the generated chip has no borders between blocks.
"""
import collections
import json
import pathlib
import re
import subprocess
import sys
import tempfile

SEVERAL = "several blocks, and pins"


def stop(text):
    print(f"cells.py: {text}", file=sys.stderr)
    sys.exit(2)


def library(liberty):
    """Cell to its area, the cells that are flops and those that gate a clock."""
    text = re.sub(r"/\*.*?\*/", "", pathlib.Path(liberty).read_text(encoding="utf-8"), flags=re.S)
    area, flops, gates = {}, set(), set()
    for cell in re.split(r"\bcell\s*\(", text)[1:]:
        name = cell[:cell.index(")")].strip(' "')
        found = re.search(r"\barea\s*:\s*([\d.]+)", cell)
        area[name] = float(found.group(1)) if found else 0.0
        if re.search(r"\bclock_gating_integrated_cell\b", cell):
            gates.add(name)
        elif re.search(r"\bff\s*\(", cell):
            flops.add(name)
    return area, flops, gates


def chip(verilog):
    with tempfile.TemporaryDirectory() as work:
        target = pathlib.Path(work) / "chip.json"
        done = subprocess.run(["yosys", "-q", "-p", f"read_verilog {verilog}; write_json {target}"], capture_output=True, text=True,
                              check=False)
        if done.returncode:
            stop(f"{verilog}: Yosys refuses it: {(done.stderr or done.stdout).strip().splitlines()[-1]}")
        modules = json.loads(target.read_text())["modules"]
    if "tc_top" not in modules:
        stop(f"{verilog}: found modules {', '.join(modules)}, expected tc_top")
    return modules["tc_top"]


def blocks(netlist, area, flops, gates):
    """Block to [area of flops and gates, area of logic]."""
    cells = netlist["cells"]
    unknown = sorted({cell["type"] for cell in cells.values()} - set(area))
    if unknown:
        stop(f"found cell {unknown[0]}, expected those of the library")
    outputs = {"Q", "Q_N", "X", "Y", "Z", "GCLK", "L_HI", "L_LO"}
    driver = {bits[0]: name for name, cell in cells.items() for pin, bits in cell["connections"].items() if pin in outputs}
    names = collections.defaultdict(list)
    for name, net in netlist["netnames"].items():
        for bit in net["bits"]:
            names[bit].append(name)

    def block_of(cell):
        found = [n for pin, bits in cells[cell]["connections"].items() if pin in outputs for n in names[bits[0]] if re.match(r"u_\w+\.", n)]
        return min(found).split(".")[0] if found else None

    # A block's flops, and all that lies before them up to flops and pins.
    fed = collections.defaultdict(set)

    def spread(start, block):
        waiting = [start]
        while waiting:
            for pin, bits in cells[waiting.pop()]["connections"].items():
                before = None if pin in outputs else driver.get(bits[0])
                if before and cells[before]["type"] not in flops and block not in fed[before]:
                    fed[before].add(block)
                    waiting.append(before)

    rows = collections.defaultdict(lambda: [0.0, 0.0])
    for name, cell in cells.items():
        if cell["type"] in flops:
            block = block_of(name) or SEVERAL
            rows[block][0] += area[cell["type"]]
            spread(name, block)
    for name, cell in cells.items():
        if cell["type"] not in flops:
            owner = next(iter(fed[name])) if len(fed[name]) == 1 else SEVERAL
            rows[owner][cell["type"] not in gates] += area[cell["type"]]
    return rows


def main(liberty, by_hand, generated):
    if pathlib.Path(by_hand).read_bytes() == pathlib.Path(generated).read_bytes():
        stop(f"{generated}: found the same netlist as {by_hand}, expected that of the generated chip")
    cells = library(liberty)
    sides = [blocks(chip(netlist), *cells) for netlist in (by_hand, generated)]
    order = sorted(set(sides[0]) | set(sides[1]), key=lambda block: (block == SEVERAL, -sum(sides[0][block])))
    print("| um2 | flops and clock gates: by hand | generated | logic: by hand | generated | both: generated / by hand |")
    print("|---|---|---|---|---|---|")

    def row(name, hand, made):
        ratio = f"{sum(made) / sum(hand):.2f}" if sum(hand) else ""
        print(f"| {name} | {hand[0]:,.0f} | {made[0]:,.0f} | {hand[1]:,.0f} | {made[1]:,.0f} | {ratio} |")

    for block in order:
        row(block.removeprefix("u_"), sides[0][block], sides[1][block])
    row("the chip", *[[sum(values[i] for values in side.values()) for i in range(2)] for side in sides])


if __name__ == "__main__":
    if len(sys.argv) != 4:
        stop("expected LIBERTY BY_HAND.v GENERATED.v")
    main(*sys.argv[1:])
