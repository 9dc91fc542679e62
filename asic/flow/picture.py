# SPDX-License-Identifier: Apache-2.0
# KLayout (-z -r): a GDS file as a picture. -rd gds=FILE -rd png=FILE
import pya

WIDTH_PX = 1600
# Of the conducting layers, bottom to top; what isn't listed is drawn thin and grey.
COLOURS = [0x4060C0, 0xC04040, 0x30A050, 0xD09020, 0x9040B0, 0x208090]

view = pya.LayoutView()
view.load_layout(gds, True)  # noqa: F821, from the command line
view.max_hier()
view.set_config("background-color", "#ffffff")
view.set_config("grid-visible", "false")
view.set_config("text-visible", "false")
view.add_missing_layers()
shown = 0
each = view.begin_layers()
while not each.at_end():
    layer = each.current()
    properties = layer.dup()
    colour = COLOURS[shown % len(COLOURS)]
    properties.fill_color = properties.frame_color = colour
    properties.dither_pattern = 5
    properties.width = 1
    view.set_layer_properties(each, properties)
    shown += 1
    each.next()
box = view.active_cellview().cell.dbbox().enlarged(2, 2)
view.zoom_box(box)
view.save_image(png, WIDTH_PX, max(200, round(WIDTH_PX * box.height() / box.width())))  # noqa: F821
