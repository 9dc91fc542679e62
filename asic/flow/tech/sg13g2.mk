# SPDX-License-Identifier: Apache-2.0
# IHP SG13G2, 0.13 um, open: from the user's own copy, PDK_ROOT as its makers define it.
cells_dir := $(PDK_ROOT)/ihp-sg13g2/libs.ref/sg13g2_stdcell
tech_needs := $(cells_dir)/lib/sg13g2_stdcell_typ_1p20V_25C.lib
tech_help := PDK_ROOT to the folder that holds ihp-sg13g2 (github.com/IHP-GmbH/IHP-Open-PDK)
corners := slow typ fast
liberty_slow := $(cells_dir)/lib/sg13g2_stdcell_slow_1p08V_125C.lib
liberty_typ := $(cells_dir)/lib/sg13g2_stdcell_typ_1p20V_25C.lib
liberty_fast := $(cells_dir)/lib/sg13g2_stdcell_fast_1p32V_m40C.lib
synth_corner := typ
clock_gate := sg13g2_lgcp_1,sg13g2_slgcp_1/GCLK/GATE+SCE
scan_tops := tc_top
clock_gate_map := $(here)/tech/sg13g2_clock_gate.v
buffer := sg13g2_buf_1 A X
cells_model := $(here)/tech/sg13g2_cells.sv
cells_verilog := $(BUILD)/sg13g2/cells.v
lef := $(cells_dir)/lef/sg13g2_tech.lef $(cells_dir)/lef/sg13g2_stdcell.lef
# A block has a few rows only, in which a cell finds a site less easily.
utilization := $(if $(filter tc_top,$(TOP)),0.98 0.97) 0.85 0.80 0.75 0.70
# Paths of 9.5 ns in the typical corner are some 15.5 ns in the slow one, of the 20 ns at sign-off.
place_options := --most-path 9.5 --leaf-load 0.18 --buffers sg13g2_buf_1 sg13g2_buf_2 sg13g2_buf_4 sg13g2_buf_8 --tie-high sg13g2_tiehi L_HI --tie-low sg13g2_tielo L_LO \
  --fillers sg13g2_fill --margin 10 --strap-layer TopMetal1 --strap-width 2 --strap-pitch 50
FACTORY_DECK ?= $(PDK_ROOT)/ihp-sg13g2/libs.tech/klayout/tech/drc/sg13g2_minimal.lydrc
factory_density := ^(AFil[.]g|GFil[.]g|M[1-5][.][jk]|M[1-5]Fil[.][hk]|TM[12][.][cd])
cells_gds := $(cells_dir)/gds/sg13g2_stdcell.gds
