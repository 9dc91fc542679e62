# SPDX-License-Identifier: Apache-2.0
# KLayout (-b -r): which pins the metal of a GDS connects, compared with the nets of a DEF's netlist: opens and shorts. Knows nothing of the
# router's wires: shapes come from the GDS, pins from LEF, and what belongs together from the pins in the DEF's NETS.
# -rd rules=RULES.json -rd lef=FILE (cells) -rd netlist_of=FILE.def -rd gds=FILE.gds -rd report=FILE.txt -rd netlist=FILE.v (to write)
import collections
import json
import re

import pya

with open(rules, encoding="utf-8") as file:  # noqa: F821, from the command line
    known = json.load(file)
supplies = known["supplies"]
PIN_LAYER = (999, 0)


def read_pins(path):
    """Of each macro: pin name to (layer, rectangle in um), and its size."""
    macros, sizes, macro, pin, layer = {}, {}, None, None, None
    with open(path, encoding="utf-8") as lef_file:
        for line in lef_file:
            words = line.split()
            if len(words) == 2 and words[0] == "MACRO":
                macro, pin = words[1], None
                macros[macro] = {}
            elif macro and words[:1] == ["SIZE"]:
                sizes[macro] = (float(words[1]), float(words[3]))
            elif macro and len(words) >= 2 and words[0] == "PIN":
                pin = words[1]
                macros[macro][pin] = []
            elif words[:1] == ["OBS"] or (words[:1] == ["END"] and words[1:] == [pin]):
                pin = None
            elif words[:1] == ["LAYER"]:
                layer = words[1]
            elif words[:1] == ["RECT"] and pin:
                macros[macro][pin].append((layer, [float(word) for word in words[1:5]]))
    return macros, sizes


def read_def(path):
    """Cells by (macro, x, y) in nm, die pins with their place, nets as sets of (cell, pin)."""
    cells, ports, nets, directions, section, scale = {}, {}, {}, {}, None, 1
    with open(path, encoding="utf-8") as def_file:
        text = def_file.read()
    scale = 1000 // int(re.search(r"UNITS DISTANCE MICRONS (\d+)", text).group(1))
    for name in ("COMPONENTS", "PINS", "NETS"):
        section = re.search(rf"^{name} \d+ ;(.*?)^END {name}", text, re.M | re.S).group(1)
        for entry in re.split(r"^\s*- ", section, flags=re.M)[1:]:
            words = entry.split()
            if name == "COMPONENTS":
                x, y, turned = re.search(r"(?:PLACED|FIXED) \( (-?\d+) (-?\d+) \) (\w+)", entry).groups()
                cells[words[1], int(x) * scale, int(y) * scale] = words[0]
            elif name == "PINS":
                layer = re.search(r"\+ LAYER (\w+)", entry)
                place = re.search(r"(?:PLACED|FIXED) \( (-?\d+) (-?\d+) \)", entry)
                net = re.search(r"\+ NET (\S+)", entry).group(1)
                if net in supplies or not place:
                    continue
                directions[words[0]] = re.search(r"\+ DIRECTION (\w+)", entry).group(1).lower()
                ports[words[0]] = (layer.group(1), int(place.group(1)) * scale, int(place.group(2)) * scale)
            else:
                nets[words[0]] = {("", b) if a == "PIN" else (a, b) for a, b in re.findall(r"\( (\S+) (\S+) \)", entry.split("+")[0])}
    return cells, ports, nets, directions


macros, sizes = read_pins(lef)  # noqa: F821
cells, ports, nets, directions = read_def(netlist_of)  # noqa: F821
layout = pya.Layout()
layout.read(gds)  # noqa: F821
top = layout.top_cell()
layer_of = {layer["name"]: layout.layer(*layer["gds"]) for layer in known["metals"] + known["cuts"]}
label_of = {layer["name"]: layout.layer(PIN_LAYER[0], number) for number, layer in enumerate(known["metals"])}
# Each pin of each cell is marked on its metal, where the GDS has that cell; the name of a metal's net is then the list of what it reaches.
problems = []
instances = collections.Counter()
for instance in top.each_inst():
    macro = instance.cell.name
    if macro not in macros:
        continue
    width, height = sizes[macro]
    corner = pya.DBox(0, 0, width, height).transformed(instance.dtrans)
    name = cells.get((macro, round(corner.left * 1000), round(corner.bottom * 1000)))
    if name is None:
        problems.append(f"a {macro} at {corner.left} {corner.bottom} um that the netlist doesn't have")
        continue
    instances[name] += 1
    for pin, shapes in macros[macro].items():
        for layer, (x0, y0, x1, y1) in shapes:
            if layer in label_of:
                middle = instance.trans * pya.Point(round((x0 + x1) * 500), round((y0 + y1) * 500))
                top.shapes(label_of[layer]).insert(pya.Text(f"{name} {pin}", pya.Trans(middle)))
problems += [f"cell {name} is there {instances[name]} times" for name in cells.values() if instances[name] != 1]
for port, (layer, x, y) in ports.items():
    top.shapes(label_of[layer]).insert(pya.Text(f" {port}", pya.Trans(x, y)))

# Flat: rails and straps touch every cell, which makes a search cell by cell slow.
extraction = pya.LayoutToNetlist(top.name, layout.dbu)
metal_layers = []
for metal in known["metals"]:
    shapes = pya.Region(top.begin_shapes_rec(layer_of[metal["name"]]))
    labels = pya.Texts(top.begin_shapes_rec(label_of[metal["name"]]))
    shapes.merged_semantics = False
    extraction.register(shapes, metal["name"])
    extraction.register(labels, metal["name"] + "_pins")
    extraction.connect(shapes)
    extraction.connect(shapes, labels)
    metal_layers.append(shapes)
for below, cut, above in zip(metal_layers, known["cuts"], metal_layers[1:]):
    cuts = pya.Region(top.begin_shapes_rec(layer_of[cut["name"]]))
    cuts.merged_semantics = False
    extraction.register(cuts, cut["name"])
    extraction.connect(cuts)
    extraction.connect(below, cuts)
    extraction.connect(cuts, above)
extraction.extract_netlist()
circuit = extraction.netlist().circuit_by_name(top.name)

# Each metal net: its members as (cell, pin) and ("", port).
expected = {member: name for name, members in nets.items() for member in members}
found = [{tuple(member.split(" ")) for member in net.name.split(",")} for net in circuit.each_net() if net.name]

# One pin can lie on more than one piece of metal, which the cell itself joins: those nets are one.
parent = list(range(len(found)))


def root(number):
    while parent[number] != number:
        parent[number] = parent[parent[number]]
        number = parent[number]
    return number


home = {}
for number, members in enumerate(found):
    for member in members:
        if member[1] in supplies:
            continue  # rails: it is the straps that must join them
        if member in home:
            parent[root(number)] = root(home[member])
        home[member] = number
joined = collections.defaultdict(set)
for number, members in enumerate(found):
    joined[root(number)] |= members
pieces = collections.defaultdict(list)
for number, members in joined.items():
    names = {expected.get(member, member[1] if member[1] in supplies else None) for member in members} - {None}
    if len(names) > 1:
        problems.append("short between " + ", ".join(sorted(names)[:4]))
    for name in names:
        pieces[name].append(members)
for name, members in nets.items():
    if name in supplies:
        continue
    reached = set().union(*pieces[name]) if pieces[name] else set()
    if len(members) > 1 and (len(pieces[name]) > 1 or members - reached):
        lost = sorted(members - max(pieces[name], key=len, default=set()))
        problems.append(f"net {name} is open: {' '.join(lost[0]).strip()} is not on it")
for name in supplies:
    if len(pieces[name]) != 1:
        problems.append(f"supply {name} is in {len(pieces[name])} pieces")

# What the metal connects, as Verilog: nets have the name of the netlist's net that most of their pins are on.
pins_of = collections.defaultdict(dict)
port_net = {}
used = set(ports)
for number, members in sorted(joined.items()):
    count = collections.Counter(expected.get(member, member[1] if member[1] in supplies else "") for member in members)
    name = count.most_common(1)[0][0] or f"metal_{number}"
    if name not in supplies:
        while (name in used and name not in {m[1] for m in members if m[0] == ""}) or (name, "") in used:
            name += "_piece"
        used.add((name, ""))
    for cell, pin in members:
        if cell:
            pins_of[cell][pin] = name
        else:
            port_net[pin] = name


def text(name):
    if name in supplies:
        return "1'b1" if name == supplies[0] else "1'b0"
    return name if re.fullmatch(r"[A-Za-z_][A-Za-z0-9_$]*", name) else f"\\{name} "


with open(netlist, "w", encoding="utf-8") as file:  # noqa: F821
    file.write(f"module {top.name} ({', '.join(text(port) for port in ports)});\n")
    for port, direction in directions.items():
        file.write(f"  {direction} {text(port)};\n")
    wires = sorted({net for pins in pins_of.values() for net in pins.values()} - set(supplies) - set(ports))
    for wire in wires:
        file.write(f"  wire {text(wire)};\n")
    for port, net in port_net.items():
        if net != port:
            pair = (port, net) if directions[port] == "output" else (net, port)
            file.write(f"  assign {text(pair[0])} = {text(pair[1])};\n")
    for (macro, _, _), cell in cells.items():
        connections = [f".{pin}({text(net)})" for pin, net in sorted(pins_of[cell].items()) if pin not in supplies]
        if connections:
            file.write(f"  {macro} {text(cell)} ({', '.join(connections)});\n")
    file.write("endmodule\n")
with open(report, "w", encoding="utf-8") as file:  # noqa: F821
    for problem in sorted(problems):
        file.write(problem + "\n")
    file.write(f"{len(cells)} cells, {len(nets)} nets of the netlist, {len(joined)} of the metal, {len(problems)} errors\n")
