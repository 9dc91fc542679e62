# SPDX-License-Identifier: Apache-2.0
# Yosys: RTL to a flat netlist of the library's cells. From the environment: SOURCES (a list of files beside it), TOP, LIBERTY, CLOCK_GATE_MAP (techmap
# file or empty), BUFFER (the smallest one, its input and its output), SCANNER (the meltstage command where the netlist gets scan, or empty).
# Writes into the current folder:
#   reference.il  the flops as the library has them, the logic as Yosys' gates: what netlist.v is proved equal to
#   flops.json    the flops under all names that the RTL has for what they hold, and the inverters, as some hold it inverted
#   netlist.v     cells of the library
#   area.txt      their count and area
#   scan/         with SCANNER: the chains by name (scan.json), the netlist for test generation (netlist.json)
yosys -import
set rtl [file dirname $::env(SOURCES)]
yosys read_liberty -lib -ignore_miss_func -setattr blackbox $::env(LIBERTY)
set list [open $::env(SOURCES)]
set files {}
foreach file [split [string trim [read $list]] \n] { if {![string match +* $file]} { lappend files $rtl/$file } }
close $list
yosys read_verilog -sv -DSYNTHESIS -I$rtl {*}$files
yosys hierarchy -check -top $::env(TOP)
# Banks of MEM are mapped by themselves, so that each stays together.
yosys setattr -mod -set keep_hierarchy 1 *tc_mem_bank*
# States stay as the RTL encodes them: what it does in a state that isn't one is said there, and each flop is the model's.
yosys synth -nofsm -flatten -top $::env(TOP) -run begin:fine
# A net that nothing drives would become 0 below, and the proof would say equal.
yosys check -assert
if {$::env(CLOCK_GATE_MAP) ne ""} {
  yosys techmap -map $::env(CLOCK_GATE_MAP)
  yosys rename -enumerate -pattern gated_clk_% w:*gclk
}
yosys opt
yosys synth -nofsm -run fine:check
yosys dfflibmap -prepare -liberty $::env(LIBERTY)
yosys json -o flops.json t:\$_DFF* t:\$_NOT_ w:*
# One net a bit, and one name a net: the proof finds flops by name, and OpenSTA of 2019 reads no concatenation on the left of an assignment.
yosys splitnets -format _
yosys opt_clean -purge
# A flop behind an inverter has lost its name.
yosys rename -enumerate -pattern flop_% t:\$_DFF* %x:+\[Q\] w:* %i
yosys setundef -zero
proc whole {} {
  yosys setattr -mod -unset keep_hierarchy *tc_mem_bank*
  yosys flatten
  yosys splitnets -format _
  yosys opt_clean -purge
}
yosys design -push-copy
whole
yosys write_rtlil reference.il
yosys design -pop
yosys dfflibmap -map-only -liberty $::env(LIBERTY)
yosys abc -liberty $::env(LIBERTY) -script [file dirname [file normalize [info script]]]/map.abc
whole
# A wire that only goes on under another name, as out of a bank, needs no buffer; a port needs a cell that drives it. Flops keep the names that the
# reference has for them: of two names of a wire that are alike else, opt_clean takes the first in the alphabet (flop_ before u_).
lassign $::env(BUFFER) buffer in out
set map [open buffer.v w]
puts $map "module $buffer (input $in, output $out); assign $out = $in; endmodule"
close $map
yosys setattr -unset hdlname w:*
yosys techmap -map buffer.v t:$buffer o:* %ci1 %d
yosys opt_clean -purge
# An output that is a constant, or an input under another name, has a cell of its own, as the layout knows it by its wire.
yosys insbuf -buf $buffer $in $out
if {[info exists ::env(SCANNER)] && $::env(SCANNER) ne ""} {
  yosys write_json unscanned.json
  exec $::env(SCANNER) dft scan unscanned.json --liberty $::env(LIBERTY) --out scan
  yosys design -reset
  yosys read_liberty -lib -ignore_miss_func -setattr blackbox $::env(LIBERTY)
  yosys read_json scan/netlist.json
  yosys hierarchy -check -top $::env(TOP)
  yosys opt_clean -purge
}
yosys tee -o area.txt stat -liberty $::env(LIBERTY)
yosys write_verilog -noattr -noexpr -nohex -nodec netlist.v
