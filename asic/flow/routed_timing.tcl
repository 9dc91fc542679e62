# SPDX-License-Identifier: Apache-2.0
# OpenSTA: setup and hold of the routed netlist with the delays of its wires, the clock through its buffers; and all delays as SDF.
# From the environment: LIBERTY, NETLIST, TOP, PERIOD_NS, WIRES (SDF of the router's resistances and capacitances), DELAYS (to write).
read_liberty $::env(LIBERTY)
read_verilog $::env(NETLIST)
link_design $::env(TOP)
create_clock -name clk -period $::env(PERIOD_NS) [get_ports clk_i]
set_propagated_clock [all_clocks]
read_sdf $::env(WIRES)
puts "== setup"
report_checks -path_delay max -format full
puts "== hold"
report_checks -path_delay min -format full
write_sdf $::env(DELAYS)
