# SPDX-License-Identifier: Apache-2.0
# OpenSTA: power of a netlist at the chip's own clock with given activities. From the environment: LIBERTY, NETLIST, TOP, PERIOD_NS,
# ACTIVITY (Tcl of activity.py).
read_liberty $::env(LIBERTY)
read_verilog $::env(NETLIST)
link_design $::env(TOP)
create_clock -name clk -period $::env(PERIOD_NS) [get_ports clk_i]
source $::env(ACTIVITY)
report_power
