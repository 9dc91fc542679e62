# SPDX-License-Identifier: Apache-2.0
# OSU 0.18 um, as Debian ships it (qflow-tech-osu018): one corner, no clock gates, no layout inside the cells.
tech_dir := /usr/share/qflow/tech/osu018
tech_needs := $(tech_dir)/osu018_stdcells.lib
tech_help := apt-get install qflow-tech-osu018
corners := typ
liberty_typ := $(tech_dir)/osu018_stdcells.lib
synth_corner := typ
clock_gate := none/none
clock_gate_map :=
buffer := BUFX2 A Y
cells_model :=
cells_verilog := $(tech_dir)/osu018_stdcells.v
lef := $(tech_dir)/osu018_stdcells.lef
# The buffers of its clock tree drive some 0.25 pF at 0.2 ns; inputs tied to a constant are routed to the rails: there is no cell for it.
utilization := 0.95 0.90 0.85 0.80 0.70
place_options := --buffers BUFX2 BUFX4 CLKBUF1 --leaf-load 0.25 --fillers FILL --margin 8 --strap-layer metal6 --strap-width 1.6 --strap-pitch 100
# Debian ships no layout inside the cells: the abstracts of the LEF stand in their place.
cells_gds :=
# Debian ships no deck of the factory's rules.
FACTORY_DECK ?=
factory_density := ^$$
