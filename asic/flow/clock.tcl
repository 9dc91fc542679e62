# SPDX-License-Identifier: Apache-2.0
# For the timing scripts: the clock, and what is refused because a report would be silent about it. From the environment: TOP, CLOCK, PERIOD_NS.
proc refuse {reason} {
  puts "Error: $::env(TOP): $reason"
  exit 1
}
# The net that a clock pin's flop drives has the RTL's name; the flop itself may not.
proc driven_net {clock_pin} {
  set cell [file dirname $clock_pin]
  foreach output {Q QN} {
    if {![catch {get_nets -of_objects [get_pins -quiet $cell/$output]} net] && $net ne ""} { return "the flop of net [get_full_name $net]" }
  }
  return "pin $clock_pin"
}
proc clock_every_flop {} {
  set clock $::env(CLOCK)
  set port [get_ports -quiet $clock]
  if {$port eq ""} { refuse "found no port $clock, expected the clock there; CLOCK=PORT names another" }
  create_clock -name clk -period $::env(PERIOD_NS) $port
  if {[with_output_to_variable said {check_setup -verbose -no_clock}]} { return }
  set pins [lrange [split [string trim $said] \n] 1 end]
  refuse "the clock at $clock does not reach [llength $pins] clock pins, among them [driven_net [string trim [lindex $pins 0]]]; this flow takes one clock"
}
# The worst path from flop to flop. `delay`: max for setup, min for hold.
proc report_worst {delay format} {
  with_output_to_variable said "report_checks -path_delay $delay -path_group clk -format $format" ;# run at the top level: no variables of here
  if {[string match "No paths found*" $said]} { refuse "found no path from flop to flop (path delay $delay), expected one to time" }
  puts -nonewline $said
}
