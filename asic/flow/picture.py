# SPDX-License-Identifier: Apache-2.0
# KLayout (-z -r): the metals of a GDS file as a picture, bottom to top. -rd rules=RULES.json -rd gds=FILE -rd png=FILE
# [-rd share=0.2: only so much of its width and height, in the middle]
import json
import tempfile

import pya

WIDTH_PX = 1600
# Of the metals, bottom to top. The lowest, which is mostly inside cells, stays pale.
COLOURS = [0xB8C4D8, 0x2F5FD0, 0xD03A3A, 0x2E9E4F, 0xE09A20, 0x8E44AD]
SOLID, HATCHED, HOLLOW = 0, 5, 1

with open(rules, encoding="utf-8") as file:  # noqa: F821, from the command line
    known = json.load(file)
view = pya.LayoutView()
view.load_layout(gds, True)  # noqa: F821
view.max_hier()
for name, value in (("background-color", "#ffffff"), ("grid-visible", "false"), ("text-visible", "false"), ("cell-box-visible", "false"), ("bitmap-oversampling", "2")):
    view.set_config(name, value)
view.clear_layers()
shown = [(metal["gds"], COLOURS[min(number, len(COLOURS) - 1)], SOLID if number < 5 else HATCHED) for number, metal in enumerate(known["metals"])]
shown.append((known["outline"], 0x808080, HOLLOW))
for (number, kind), colour, pattern in shown:
    layer = pya.LayerProperties()
    layer.source = f"{number}/{kind}@1"
    layer.fill_color = layer.frame_color = 0xFF000000 | colour
    layer.dither_pattern = pattern
    layer.width = 1
    view.insert_layer(view.end_layers(), layer)
box = view.active_cellview().cell.dbbox().enlarged(2, 2)
part = float(globals().get("share", 1))
middle = box.center()
box = pya.DBox(middle.x - box.width() * part / 2, middle.y - box.height() * part / 2, middle.x + box.width() * part / 2, middle.y + box.height() * part / 2)
# Without a window KLayout 0.28 draws the colours of a file alone.
with tempfile.NamedTemporaryFile(suffix=".lyp") as properties:
    view.save_layer_props(properties.name)
    view.load_layer_props(properties.name)
view.zoom_box(box)
view.save_image(png, WIDTH_PX, max(200, round(WIDTH_PX * box.height() / box.width())))  # noqa: F821
