#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""fold_wires.py DELAYS.sdf FOLDED.sdf: each wire's delay put into the paths of the cell that it leads to.

For simulators that leave INTERCONNECT out (Icarus 11 does so without a word). A path from a pin becomes slower by the wire before that pin,
by its slower edge; a wire to a pin from which no path starts (D of a flop) is left out. Takes SDF as OpenSTA writes it. Prints how
many wires went into paths; exits with 2 and one line on wrong use.
"""
import pathlib
import re
import sys

VALUES = re.compile(r"\(([-\d.]+)::([-\d.]+)\)")
WIRE = re.compile(r"\(INTERCONNECT \S+ (\S+)((?: \([-\d.]+::[-\d.]+\))+)\)")
PATH = re.compile(r"(\(IOPATH (?:\((?:pos|neg)edge (\S+)\)|(\S+)) \S+)((?: \([-\d.]+::[-\d.]+\))+)\)")
CELL = "\n (CELL\n"


def folded(text):
    """The text with wires in the cells' paths, how many wires there are, and how many of them went into a path."""
    head, *cells = text.rstrip().removesuffix(")").split(CELL)
    wires = {}  # delay, least and longest, by instance/pin
    for sink, values in WIRE.findall(text):
        edges = [(float(least), float(longest)) for least, longest in VALUES.findall(values)]
        wires[sink] = (min(least for least, _ in edges), max(longest for _, longest in edges))
    used = set()

    def slower(instance, path):
        sink = f"{instance}/{path[2] or path[3]}"
        if sink not in wires:
            return path[0]
        used.add(sink)
        wire = wires[sink]
        delays = VALUES.sub(lambda v: f"({float(v[1]) + wire[0]:.3f}::{float(v[2]) + wire[1]:.3f})", path[4])
        return f"{path[1]}{delays})"

    paths = []
    for cell in cells:
        if "(INTERCONNECT " in cell:
            continue
        instance = re.search(r"\(INSTANCE ?(\S*)\)", cell)[1]
        paths.append(CELL + PATH.sub(lambda path, i=instance: slower(i, path), cell))
    return head + "".join(paths) + ")\n", len(wires), len(used)


def main(delays, result):
    if not pathlib.Path(delays).is_file():
        print(f"fold_wires.py: {delays}: not there, expected an SDF file", file=sys.stderr)
        return 2
    text, wires, used = folded(pathlib.Path(delays).read_text(encoding="utf-8"))
    pathlib.Path(result).write_text(text, encoding="utf-8")
    print(f"{used} of {wires} wires put into paths")
    return 0


if __name__ == "__main__":
    if len(sys.argv) != 3:
        print("fold_wires.py: expected DELAYS.sdf FOLDED.sdf", file=sys.stderr)
        sys.exit(2)
    sys.exit(main(*sys.argv[1:]))
