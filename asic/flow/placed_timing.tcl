# SPDX-License-Identifier: Apache-2.0
# OpenSTA: setup and hold of the placed netlist at one corner, the clock through its tree, wires as placement lets expect them.
# From the environment: LIBERTY, NETLIST, TOP, PERIOD_NS, WIRES (SPEF), DELAYS (SDF to write, or empty).
read_liberty $::env(LIBERTY)
read_verilog $::env(NETLIST)
link_design $::env(TOP)
create_clock -name clk -period $::env(PERIOD_NS) [get_ports clk_i]
set_propagated_clock [all_clocks]
read_spef $::env(WIRES)
puts "== setup"
report_checks -path_delay max -path_group clk -format full_clock_expanded
puts "== hold"
report_checks -path_delay min -path_group clk -format full_clock_expanded
puts "== skew"
report_clock_skew -setup
report_clock_skew -hold
if {$::env(DELAYS) ne ""} { write_sdf $::env(DELAYS) }
