#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""use.py CELLS.txt TIMING.txt BLOCK BOARD: one line of what a block takes, its shift registers (harness.py) included, and its fastest clock.

Exits with 1 when it takes over 5 % more look-up tables than recorded.tsv says. A wanted growth
is recorded there by hand, with the change that causes it.
"""
import pathlib
import re
import sys

GROWTH = 1.05


def main(cells_path, timing_path, block, board):
    cells = {kind: int(count) for kind, count in re.findall(r"^ +(SB_\w+) +(\d+)$", pathlib.Path(cells_path).read_text(), re.M)}
    clock = re.search(r"\(([\d.]+) MHz\)", pathlib.Path(timing_path).read_text())
    luts = cells.get("SB_LUT4", 0)
    flops = sum(count for kind, count in cells.items() if kind.startswith("SB_DFF"))
    rams = sum(count for kind, count in cells.items() if kind.startswith("SB_RAM40"))
    print(f"{block:<12} {luts:>6} LUT4 {flops:>6} flops {cells.get('SB_MAC16', 0):>3} DSP {rams:>3} RAM {clock.group(1):>7} MHz")
    for line in (pathlib.Path(__file__).parent / "recorded.tsv").read_text().splitlines():
        recorded_board, recorded_block, recorded = line.split("\t")
        if (recorded_board, recorded_block) == (board, block) and luts > GROWTH * int(recorded):
            print(f"use.py: {block} on {board} takes {luts} LUT4, recorded are {recorded}: more than 5 % growth", file=sys.stderr)
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
