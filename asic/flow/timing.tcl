# SPDX-License-Identifier: Apache-2.0
# OpenSTA: setup and hold of a netlist at one corner. From the environment: FLOW (this folder), LIBERTY, NETLIST, TOP, CLOCK, PERIOD_NS.
# Clock and reset are ideal: placement builds their trees (reset's checks are the group that is left out). Inputs are asynchronous to the clock (synchronisers) and start no path.
source $::env(FLOW)/clock.tcl
read_liberty $::env(LIBERTY)
read_verilog $::env(NETLIST)
link_design $::env(TOP)
clock_every_flop
puts "== setup"
report_worst max full
puts "== hold"
report_worst min full
