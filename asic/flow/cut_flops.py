#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""cut_flops.py NETLIST.json TOP GATE OUT.json [PORT=VALUE]...: a flat netlist of Yosys' own cells without its flops and clock gates.

Each flop's output becomes an input `<net>.q`, what it takes becomes the outputs `<net>.d`, `.clk`, `.clear` and `.set` (the last
two active high). Names are those of nets with the attribute `named`: pins of flattened cells have names too. GATE names the clock gates
as TYPE[,TYPE]/OUTPUT[/ENABLE+TEST]: each becomes an input `<net>.g` and outputs of its input pins; TEST opens it as ENABLE does, so that
both are one output. A cell that isn't Yosys' own, a block kept whole, becomes inputs and outputs `<cell>.<pin>`. Two netlists whose flops stand on nets of the same names are equal as machines when these combinational rests are
equal, output by output. PORT=0 and PORT=1 hold an input port, all bits of it (a bit each too: PORT_3); PORT=- leaves an output port out.
"""
import json
import re
import sys

WRITTEN_PRIVATE = re.compile(r"^_\d+_")  # what write_verilog calls a net that has no name of its own
FLOP = re.compile(r"^\$_(?:DFF_P_|DFF_PN[01]_|DFFSR_PNN_)$")


def stop(text):
    print(f"cut_flops.py: {text}", file=sys.stderr)
    sys.exit(2)


def named_as(name, ports_as):
    """What PORT=VALUE says of a port, or of a bit of it."""
    return ports_as.get(name, ports_as.get(re.sub(r"(_\d+|\[\d+\])$", "", name)))


def name_of_net(module, ports_as):
    """One public name a net bit, not that of a port that is left out: the shortest, then the first in the alphabet."""
    names = {}
    for name, net in module["netnames"].items():
        if net.get("hide_name") or "named" not in net["attributes"] or WRITTEN_PRIVATE.match(name) or named_as(name, ports_as) == "-":
            continue
        for index, bit in enumerate(net["bits"]):
            full = name if len(net["bits"]) == 1 else f"{name}[{index + net.get('offset', 0)}]"
            names.setdefault(bit, []).append(full)
    return {bit: min(all_names, key=lambda n: (len(n), n)) for bit, all_names in names.items()}


def main(source, top, gate, target, *ports_as):
    gate_types, gate_output, *gate_enables = gate.split("/")
    gate_types = gate_types.split(",")
    enable, test = gate_enables[0].split("+") if gate_enables else ("", "")
    with open(source, encoding="utf-8") as file:
        module = json.load(file)["modules"][top]
    ports_as = dict(item.split("=") for item in ports_as)
    names = name_of_net(module, ports_as)
    fresh = max([bit for cell in module["cells"].values() for bits in cell["connections"].values() for bit in bits
                 if isinstance(bit, int)] + [1]) + 1
    ports, held = {}, {}
    for name, entry in module["ports"].items():
        value = named_as(name, ports_as)
        if value is None:
            ports[name] = entry
        elif value in ("0", "1") and entry["direction"] == "input":
            held.update((bit, value) for bit in entry["bits"])
        elif value != "-" or entry["direction"] != "output":
            stop(f"{source}: {name}={value}: expected 0 or 1 for an input port, - for an output port; it is an {entry['direction']}")
    for cell in module["cells"].values():
        for pin, bits in cell["connections"].items():
            cell["connections"][pin] = [held.get(bit, bit) for bit in bits]
    cells = {}
    cut = 0

    def inverse(bit):
        nonlocal fresh
        if bit in ("0", "1"):
            return "1" if bit == "0" else "0"
        cells[f"inverse${fresh}"] = {"type": "$_NOT_", "port_directions": {"A": "input", "Y": "output"},
                                     "connections": {"A": [bit], "Y": [fresh]}}
        fresh += 1
        return fresh - 1

    def either(a, b):
        nonlocal fresh
        if a == "1" or b == "1":
            return "1"
        if a == "0" or b == "0":
            return b if a == "0" else a
        cells[f"either${fresh}"] = {"type": "$_OR_", "port_directions": {"A": "input", "B": "input", "Y": "output"},
                                    "connections": {"A": [a], "B": [b], "Y": [fresh]}}
        fresh += 1
        return fresh - 1

    def port(name, direction, bit):
        if name in ports:
            stop(f"{source}: two nets are called {name}")
        ports[name] = {"direction": direction, "bits": [bit]}

    for name, cell in module["cells"].items():
        kind, pins = cell["type"], {pin: bits[0] for pin, bits in cell["connections"].items() if bits}
        if kind in gate_types:
            net = names.get(pins[gate_output])
            if net is None:
                stop(f"{source}: clock gate {name} drives no named net, expected one; keep the names of clocks")
            port(f"{net}.g", "input", pins.pop(gate_output))
            if test in pins:
                pins[enable] = either(pins[enable], pins.pop(test))
            for pin, bit in pins.items():
                port(f"{net}.{pin}", "output", bit)
        elif FLOP.match(kind):
            net = names.get(pins["Q"])
            if net is None:
                stop(f"{source}: flop {name} drives no named net, expected one; keep the names of flops")
            clear = set_ = "0"
            if kind.startswith("$_DFFSR"):
                clear, set_ = inverse(pins["R"]), inverse(pins["S"])
            elif kind.endswith("N0_"):
                clear = inverse(pins["R"])
            elif kind.endswith("N1_"):
                set_ = inverse(pins["R"])
            port(f"{net}.q", "input", pins["Q"])
            for pin, bit in (("d", pins["D"]), ("clk", pins["C"]), ("clear", clear), ("set", set_)):
                port(f"{net}.{pin}", "output", bit)
            cut += 1
        elif not kind.startswith("$_"):
            for pin, bits in cell["connections"].items():
                to_block = cell["port_directions"][pin] == "input"
                for index, bit in enumerate(bits):
                    port(f"{name}.{pin}[{index}]", "output" if to_block else "input", bit)
        elif "DFF" in kind or "DLATCH" in kind:
            stop(f"{source}: {name} is a {kind}, expected one of the kinds that the flow maps to")
        else:
            cells[name] = cell
    module["ports"] = ports
    module["cells"] = cells
    module["netnames"] = {}
    with open(target, "w", encoding="utf-8") as file:
        json.dump({"modules": {top: module}}, file)
    print(f"{cut} flops cut")


if __name__ == "__main__":
    if len(sys.argv) < 5:
        stop("expected NETLIST.json TOP GATE OUT.json [PORT=VALUE]...")
    main(*sys.argv[1:])
