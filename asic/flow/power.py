#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""power.py COUNTS CLOCKS NETLIST.json TOP LIBERTY CLOCK_HZ [WIRES.spef]: power of a netlist over a recorded run, from Verilator's toggle counts.

Each change of a pin costs the energy that its Liberty tables give (mean of all conditions; slew 0.1 ns, the load of what is behind it),
and half of C V^2 for the pins and the wire that it drives; without WIRES.spef for the pins alone. A flop whose clock is gated is charged for
the clocks that come through its gate (OpenSTA of 2019 charges it for all). Prints W by kind of cell and what it adds up to; exits with 1 when
one net in a hundred has no count.
"""
import bisect
import collections
import json
import re
import sys

POINT = re.compile(r"\x01page\x02v_toggle/[^\x01]*\x01o\x02([^\x01]*)\x01.*' (\d+)$")
ESCAPED = re.compile(r"__0([0-9a-f]{2})")  # Verilator's way with characters that C++ doesn't allow
TOKEN = re.compile(r'"([^"]*)"|([{}();:,])|([^\s{}();:,"]+)')
SLEW_NS = 0.1

Group = collections.namedtuple("Group", "kind name values groups")


def read_liberty(path):
    """The library as nested groups; values: attribute -> list of strings."""
    text = re.sub(r"/\*.*?\*/", "", open(path, encoding="utf-8").read(), flags=re.S).replace("\\\n", " ")
    tokens = [m.group(1) if m.group(1) is not None else m.group(2) or m.group(3) for m in TOKEN.finditer(text)]
    root, stack, i = Group("", "", {}, []), [], 0
    stack.append(root)
    while i < len(tokens):
        word = tokens[i]
        if word == "}":
            stack.pop()
            i += 1
        elif tokens[i + 1 : i + 2] == [":"]:
            end = tokens.index(";", i)
            stack[-1].values[word] = tokens[i + 2 : end]
            i = end + 1
        elif tokens[i + 1 : i + 2] == ["("]:
            end = tokens.index(")", i)
            inside = [t for t in tokens[i + 2 : end] if t != ","]
            if tokens[end + 1 : end + 2] == ["{"]:
                group = Group(word, inside[0] if inside else "", {}, [])
                stack[-1].groups.append(group)
                stack.append(group)
                i = end + 2
            else:
                stack[-1].values[word] = inside
                i = end + 1
        else:
            i += 1
    return root.groups[0]


def numbers(words):
    return [float(x) for word in words for x in word.replace(",", " ").split()]


def interpolate(axis, values, x):
    """Linear; outside the axis its end (no extrapolation)."""
    if len(axis) == 1 or x <= axis[0]:
        return values[0]
    if x >= axis[-1]:
        return values[-1]
    k = bisect.bisect_right(axis, x)
    share = (x - axis[k - 1]) / (axis[k] - axis[k - 1])
    return values[k - 1] + share * (values[k] - values[k - 1])


def energy(table, load):
    """pJ of one table (rise_power, fall_power) at SLEW_NS and this load in pF."""
    values = numbers(table.values["values"])
    slews, loads = numbers(table.values.get("index_1", [])), numbers(table.values.get("index_2", []))
    if not slews:
        return values[0]
    if not loads:
        return interpolate(slews, values, SLEW_NS)
    rows = [interpolate(loads, values[r * len(loads) : (r + 1) * len(loads)], load) for r in range(len(slews))]
    return interpolate(slews, rows, SLEW_NS)


class Cell:
    def __init__(self, group):
        self.leakage = float(group.values.get("cell_leakage_power", ["0"])[0])
        self.gate = "clock_gating_integrated_cell" in group.values
        self.flop = any(g.kind in ("ff", "latch") for g in group.groups)
        self.pins = {g.name: g for g in group.groups if g.kind == "pin"}
        copied = {name: re.sub(r"[()!' ]", "", "".join(g.values.get("function", []))) for name, g in self.pins.items()}
        states = {g.name for g in group.groups if g.kind in ("ff", "latch")}
        self.state = {name: of for name, of in copied.items() if of in states}
        # of buffers and inverters: their output changes as often as their input
        self.repeated = {name: of for name, of in copied.items() if of in self.pins}

    def capacitance(self, pin):
        return float(self.pins[pin].values.get("capacitance", ["0"])[0])

    def drives(self, pin):
        return self.pins[pin].values["direction"] == ["output"]

    def change(self, pin, load):
        """pJ of one change of this pin: mean over rise and fall and over the conditions of the library. A pin's tables for other
        pins' changes (RESET_B) come with those of its clock: each is one way for the pin to change, so they too go into the mean."""
        powers = [g for g in self.pins[pin].groups if g.kind == "internal_power"]
        plain = [g for g in powers if "when" not in g.values and g.values.get("related_pin", ["CLK"]) != ["RESET_B"]] or powers
        tables = [t for g in plain for t in g.groups if t.kind in ("rise_power", "fall_power")]
        return sum(energy(t, load) for t in tables) / len(tables) if tables else 0.0


def toggle_counts(path):
    toggles = {}
    for line in open(path, encoding="utf-8", errors="replace"):
        found = POINT.search(line.rstrip())
        if found:
            toggles[ESCAPED.sub(lambda code: chr(int(code.group(1), 16)), found.group(1))] = int(found.group(2))
    return toggles


def wires_pf(path):
    """Of each net with a wire: what the wire holds, as the SPEF sums it up."""
    lines = (line.split() for line in open(path, encoding="utf-8") if line.startswith("*D_NET"))
    return {name.replace("\\", ""): float(pf) for _, name, pf in lines}


class Alike:
    """Nets that change together: one of them has the count (simulation merges what buffers part)."""

    def __init__(self):
        self.of = {}

    def first(self, bit):
        while self.of.get(bit, bit) != bit:
            bit = self.of[bit]
        return bit

    def join(self, a, b):
        self.of[self.first(a)] = self.first(b)


def main(counts, clocks, netlist, top, liberty, clock_hz, spef=None):
    library = read_liberty(liberty)
    cells = {g.name: Cell(g) for g in library.groups if g.kind == "cell"}
    volts = float(library.values["nom_voltage"][0])
    toggles = toggle_counts(counts)
    module = json.load(open(netlist, encoding="utf-8"))["modules"][top]
    parts = {name: cell for name, cell in module["cells"].items() if cell["connections"]}  # not fillers
    wire = wires_pf(spef) if spef else {}
    names, load, alike = collections.defaultdict(list), collections.Counter(), Alike()
    for name, net in module["netnames"].items():
        if len(net["bits"]) == 1:
            names[net["bits"][0]].append(name)
    for bit, called in names.items():
        load[bit] += next((wire[name] for name in called if name in wire), 0.0)
    for instance, cell in parts.items():
        of = cells[cell["type"]]
        for pin, (bit,) in cell["connections"].items():
            names[bit].append(f"{instance}.{pin}")  # flattening may have called a net after any pin on it
            if not of.drives(pin):
                load[bit] += of.capacitance(pin)
            elif pin in of.state:
                names[bit].append(f"{instance}.{of.state[pin]}")
            elif pin in of.repeated:
                alike.join(bit, cell["connections"][of.repeated[pin]][0])
    told = {alike.first(bit): toggles[name] for bit, called in names.items() for name in called if name in toggles}
    count = {bit: told.get(alike.first(bit), 0) for bit in names}
    missing = sum(alike.first(bit) not in told for bit in names)

    # A change of all nets together happens this often a second; energies are in pJ.
    watts_of_a_count = 1e-12 * float(clock_hz) / float(clocks)
    clock_bit = module["ports"]["clk_i"]["bits"][0]
    clock_nets = {alike.first(bit) for bit in [clock_bit] + [cell["connections"][pin][0] for cell in parts.values()
                                                         if cells[cell["type"]].gate for pin in cell["connections"] if cells[cell["type"]].drives(pin)]}
    internal, switching, number, leakage = collections.Counter(), collections.Counter(), collections.Counter(), 0.0
    clocked = 0.0
    for cell in parts.values():
        of = cells[cell["type"]]
        out = next((bit for pin, (bit,) in cell["connections"].items() if of.drives(pin)), None)
        kind = "clock gates" if of.gate else "flops" if of.flop else "clock tree" if alike.first(out) in clock_nets else "logic"
        number[kind] += 1
        leakage += of.leakage * 1e-12
        for pin, (bit,) in cell["connections"].items():
            internal[kind] += count[bit] * of.change(pin, load[bit] if of.drives(pin) else 0) * watts_of_a_count
            if of.drives(pin):
                switching[kind] += count[bit] * 0.5 * load[bit] * volts**2 * watts_of_a_count
        if kind == "flops":
            clocked += count[cell["connections"]["CLK"][0]] / 2 / float(clocks)
    # The clock's own pin drives what is not behind a gate.
    switching["clock pin"] = count[clock_bit] * 0.5 * load[clock_bit] * volts**2 * watts_of_a_count

    total = sum(internal.values()) + sum(switching.values()) + leakage
    print(f"{'':14}{'cells':>8}{'internal W':>13}{'switching W':>13}{'total W':>13}")
    for kind in ("logic", "flops", "clock tree", "clock gates", "clock pin"):
        print(f"{kind:14}{number[kind]:8}{internal[kind]:13.3e}{switching[kind]:13.3e}{internal[kind] + switching[kind]:13.3e}")
    print(f"{'leakage':14}{'':34}{leakage:13.3e}")
    print(f"{'Total':14}{'':34}{total:13.3e}   {1e3 * total / volts:.3f} mA at {volts} V, {float(clock_hz) / 1e6:g} MHz")
    print(f"of each clock {100 * clocked / number['flops']:.1f} % of the flops are reached; {missing} of {len(names)} nets without a count")
    return 0 if missing < len(names) / 100 else 1


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
