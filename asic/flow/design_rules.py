# SPDX-License-Identifier: Apache-2.0
# KLayout (-b -r): the routing layers of a GDS against the rules in tech/*_rules.json, cells and wires together.
# -rd rules=RULES.json -rd gds=FILE.gds -rd report=FILE.txt -rd marks=FILE.lyrdb (for KLayout's marker browser)
import json

import pya

with open(rules, encoding="utf-8") as file:  # noqa: F821, from the command line
    known = json.load(file)
layout = pya.Layout()
layout.read(gds)  # noqa: F821
top = layout.top_cell()
nm = layout.dbu
database = pya.ReportDatabase(top.name)
database_cell = database.create_cell(top.name)
found = {}


def dbu(value_um):
    return round(value_um / nm)


def region(layer):
    index = layout.find_layer(*layer["gds"])
    return pya.Region() if index is None else pya.Region(top.begin_shapes_rec(index)).merged()


def tell(rule, description, errors):
    category = database.create_category(rule)
    category.description = description
    found[rule] = (errors.count(), description)
    for error in errors.each():
        item = database.create_item(database_cell.rdb_id(), category.rdb_id())
        item.add_value(error.to_dtype(nm))


metals = {layer["name"]: region(layer) for layer in known["metals"]}
for layer in known["metals"]:
    name, metal = layer["name"], metals[layer["name"]]
    tell(f"{name}.width", f"width < {layer['width']} um", metal.width_check(dbu(layer["width"])))
    tell(f"{name}.space", f"space < {layer['space']} um", metal.space_check(dbu(layer["space"])))
    if layer["area"]:
        tell(f"{name}.area", f"area < {layer['area']} um2", metal.with_area(0, round(layer["area"] / nm / nm), False))
    if "wide" in layer:
        wide = layer["wide"]
        half = dbu(wide["width"] / 2)
        broad = metal.sized(-half).sized(half)
        tell(f"{name}.wide", f"space < {wide['space']} um beside {wide['width']} um or wider, {wide['run']} um long",
             broad.separation_check(metal - broad, dbu(wide["space"]), False, pya.Region.Projection, None, dbu(wide["run"]), None)
             + broad.space_check(dbu(wide["space"]), False, pya.Region.Projection, None, dbu(wide["run"]), None))
for below, cut, above in zip(known["metals"], known["cuts"], known["metals"][1:]):
    name, cuts = cut["name"], region(cut)
    size = dbu(cut["size"])
    square = pya.Box(0, 0, size, size)
    tell(f"{name}.size", f"other than {cut['size']} by {cut['size']} um", cuts - cuts.with_bbox_min(size, size + 1, False).with_bbox_max(size, size + 1, False).rectangles())
    tell(f"{name}.space", f"space < {cut['space']} um", cuts.space_check(dbu(cut["space"])))
    for metal, side in ((below, "below"), (above, "above")):
        over = metals[metal["name"]]
        rule = cut[side]
        tell(f"{name}.{metal['name']}.open", "cut without metal", cuts - over)
        tell(f"{name}.{metal['name']}.side", f"metal less than {rule['side']} um beside the cut", cuts.enclosed_check(over, dbu(rule["side"])))
        if rule["end"] > rule["side"]:
            end, beside = dbu(rule["end"]), dbu(rule["side"])
            good = cuts.sized(end, beside, 2).inside(over) + cuts.sized(beside, end, 2).inside(over)
            tell(f"{name}.{metal['name']}.end", f"metal less than {rule['end']} um over two opposite sides of the cut", cuts.outside(good))
database.save(marks)  # noqa: F821
total = sum(count for count, _ in found.values())
with open(report, "w", encoding="utf-8") as file:  # noqa: F821
    for rule, (count, description) in found.items():
        if count:
            file.write(f"{rule}: {count} ({description})\n")
    file.write(f"{len(found)} rules, {total} errors\n")
