#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""finish_netlist.py BITS.asc NETLIST.v: adds what icebox_vlog leaves out of an HX8K's or UP5K's netlist.

That is the UP5K's DSP blocks: they become SB_MAC16, with the parameters that their bits say.
NETLIST.v has icebox_vlog's comments, which say what each wire is made of; it is printed without them.
"""
import re
import sys

sys.path.insert(0, "/usr/share/fpga-icestorm/python")
import icebox  # noqa: E402  (Debian keeps it where no import looks)

WIDTHS = {"A": 16, "B": 16, "C": 16, "D": 16, "O": 32}


def wires_of_segments(netlist):
    """Of each segment (column, row, name) of the device the wire that it belongs to."""
    wire_of, wire = {}, None
    for line in netlist.splitlines():
        if declared := re.match(r"(?:wire|reg) (\\?\S+?)\s*(?:= 0)?;", line):
            wire = declared[1]
        elif segment := re.match(r"// \((\d+), (\d+), '(.*)'\)", line):
            wire_of[int(segment[1]), int(segment[2]), segment[3]] = wire
    return wire_of


def is_set(device, x, y, bit):
    bits = next(entry[0] for entry in device.tile_db(x, y) if entry[1:] == ["IpConfig", bit])
    return icebox.tileconfig(device.tile(x, y)).match(bits)


def parameters(device, x, y):
    values = {}
    for name, place in device.get_dsp_config_db(x, y).items():
        parameter, _, bit = re.fullmatch(r"(.*?)(_([01]))?", name).groups()
        values[parameter] = values.get(parameter, 0) | int(is_set(device, *place)) << int(bit or 0)
    return values


def multiplier(device, x, y, wire_of):
    """One SB_MAC16, or nothing where no wire leaves the block."""
    segments = device.get_dsp_nets_db(x, y)
    if not any(segments[f"O_{bit}"] in wire_of for bit in range(32)):
        return []
    ports = []
    for port in sorted({re.sub(r"_\d+$", "", name) for name in segments}):
        bits = [segments[f"{port}_{bit}"] for bit in reversed(range(WIDTHS[port]))] if port in WIDTHS else [segments[port]]
        open_pin = {"O": "", "CO": "", "CE": "1'b1"}.get(port, "1'b0")
        if port == "O":
            ports.append(f".O(mac_{x}_{y})")
        else:
            ports.append(f".{port}({{{', '.join(wire_of.get(bit, open_pin) for bit in bits)}}})" if open_pin else f".{port}()")
    values = ", ".join(f".{name}({value})" for name, value in parameters(device, x, y).items())
    lines = [f"wire [31:0] mac_{x}_{y};", f"SB_MAC16 #({values}) multiplier_{x}_{y} ({', '.join(ports)});"]
    return lines + [f"assign {wire_of[segments[f'O_{bit}']]} = mac_{x}_{y}[{bit}];" for bit in range(32) if segments[f"O_{bit}"] in wire_of]


def main(bits_path, netlist_path):
    device = icebox.iceconfig()
    device.read_file(bits_path)
    with open(netlist_path, encoding="utf-8") as file:
        netlist = file.read()
    wire_of = wires_of_segments(netlist)
    added = [line for x, y in sorted(device.dsp_tiles[0]) for line in multiplier(device, x, y, wire_of)]
    plain = re.sub(r"^//.*\n", "", netlist, flags=re.M)
    print(plain.replace("\nendmodule", "\n".join(["", *added, "endmodule"])))


if __name__ == "__main__":
    main(*sys.argv[1:])
