# SPDX-License-Identifier: Apache-2.0
# OpenSTA: setup, hold and the slowest edge of the placed or routed netlist at one corner, the clock through its tree; setup and hold once more with
# on-chip variation: late paths take 5 % longer, early ones 5 % less.
# From the environment: FLOW (this folder), LIBERTY, NETLIST, TOP, CLOCK, PERIOD_NS, WIRES (SPEF), DELAYS (SDF to write, or empty).
source $::env(FLOW)/clock.tcl
read_liberty $::env(LIBERTY)
read_verilog $::env(NETLIST)
link_design $::env(TOP)
clock_every_flop
set_propagated_clock [all_clocks]
read_spef $::env(WIRES)
puts "== setup"
report_worst max full_clock_expanded
puts "== hold"
report_worst min full_clock_expanded
puts "== transition"
report_check_types -max_transition
puts "== skew"
report_clock_skew -setup
report_clock_skew -hold
if {$::env(DELAYS) ne ""} { write_sdf $::env(DELAYS) }
set_timing_derate -early 0.95
set_timing_derate -late 1.05
puts "== setup_varied"
report_worst max full_clock_expanded
puts "== hold_varied"
report_worst min full_clock_expanded
