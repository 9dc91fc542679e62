# SPDX-License-Identifier: Apache-2.0
# OpenSTA: setup and hold of a netlist at one corner. From the environment: LIBERTY, NETLIST, TOP, PERIOD_NS.
# Clock and reset are ideal: placement builds their trees (reset's checks are the group that is left out). Inputs are asynchronous to the clock (synchronisers) and start no path.
read_liberty $::env(LIBERTY)
read_verilog $::env(NETLIST)
link_design $::env(TOP)
create_clock -name clk -period $::env(PERIOD_NS) [get_ports clk_i]
puts "== setup"
report_checks -path_delay max -path_group clk -format full
puts "== hold"
report_checks -path_delay min -path_group clk -format full
