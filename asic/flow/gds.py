# SPDX-License-Identifier: Apache-2.0
# KLayout (-b -r): a routed DEF as GDS, with the layout of the library's cells when there is one, else with their abstracts from LEF.
# -rd rules=RULES.json -rd lef=FILE[,FILE] -rd routed=FILE.def -rd cells=FILE.gds (or empty) -rd gds=FILE.gds (to write)
import json
import tempfile

import pya

with open(rules, encoding="utf-8") as file:  # noqa: F821, from the command line
    known = json.load(file)
options = pya.LoadLayoutOptions()
config = options.lefdef_config
config.dbu = 0.001
config.lef_files = lef.split(",")  # noqa: F821
config.read_lef_with_def = False
if cells:  # noqa: F821
    config.macro_layout_files = [cells]  # noqa: F821
    config.macro_resolution_mode = 2
else:
    config.macro_resolution_mode = 1
with tempfile.NamedTemporaryFile("w", suffix=".map") as layers:
    for layer in known["metals"] + known["cuts"]:
        number, kind = layer["gds"]
        layers.write(f"{layer['name']} NET,SPNET,PIN,VIA,LEFPIN,LEFOBS {number} {kind}\n")
        if layer in known["metals"]:
            layers.write(f"NAME {layer['name']}/PIN {number} 25\n")
    layers.write(f"DIEAREA ALL {known['outline'][0]} {known['outline'][1]}\n")
    layers.flush()
    config.map_file = layers.name
    layout = pya.Layout()
    layout.read(routed, options)  # noqa: F821
save = pya.SaveLayoutOptions()
save.gds2_write_timestamps = False
layout.write(gds, save)  # noqa: F821
