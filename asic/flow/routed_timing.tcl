# SPDX-License-Identifier: Apache-2.0
# OpenSTA: setup and hold of the routed netlist with the delays of its wires, the clock through its buffers; and all delays as SDF.
# From the environment: FLOW (this folder), LIBERTY, NETLIST, TOP, CLOCK, PERIOD_NS, WIRES (SDF of the router's resistances and capacitances), DELAYS (to write).
source $::env(FLOW)/clock.tcl
read_liberty $::env(LIBERTY)
read_verilog $::env(NETLIST)
link_design $::env(TOP)
clock_every_flop
set_propagated_clock [all_clocks]
read_sdf $::env(WIRES)
puts "== setup"
report_worst max full
puts "== hold"
report_worst min full
write_sdf $::env(DELAYS)
