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
cells_model :=
