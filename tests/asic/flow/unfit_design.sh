#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# unfit_design.sh FLOW: designs that the flow cannot take, or not so, each refused with what is wrong in it; and one that it takes, whose clock
# has another name.
set -euo pipefail
flow=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
unset MAKEFLAGS MAKELEVEL

# netlist NAME [MAKE-VARIABLE]... < VERILOG: status and words of the flow up to the netlist.
netlist() {
  local name=$1
  shift
  mkdir -p "$work/$name"
  cat >"$work/$name/$name.v"
  echo "$name.v" >"$work/$name/files"
  status=0
  make -s -C "$flow" BUILD="$work/build" TECH=osu018 SOURCES="$work/$name/files" TOP="$name" "$@" netlist >"$work/told" 2>&1 || status=$?
}
refused() {
  if [ $status = 0 ] || ! grep -qE "$1" "$work/told"; then
    echo "unfit_design.sh: status $status, expected a refusal that says: $1"
    cat "$work/told"
    exit 1
  fi
}

netlist two_clocks <<'EOT'
module two_clocks(input clk_i, clk_b, rst_ni, input [3:0] d_i, output [3:0] q_o);
  reg a;
  reg [3:0] b, c;
  always @(posedge clk_i or negedge rst_ni) if (!rst_ni) a <= 0; else a <= ^d_i ^ a;
  always @(posedge clk_b or negedge rst_ni) if (!rst_ni) {b, c} <= 0; else {b, c} <= {d_i, b + 4'd1};
  assign q_o = c ^ {4{a}};
endmodule
EOT
refused "two_clocks: the clock at clk_i does not reach 8 clock pins, among them the flop of net [bc]_"

netlist undriven <<'EOT'
module undriven(input clk_i, rst_ni, input [3:0] d_i, output reg [3:0] q_o);
  wire nowhere;
  wire [1:0] half;
  assign half[0] = d_i[0];
  always @(posedge clk_i or negedge rst_ni) if (!rst_ni) q_o <= 0; else q_o <= q_o + d_i ^ {4{nowhere}} ^ {2'b0, half};
endmodule
EOT
refused 'undriven\.\\nowhere is used but has no driver'
refused 'undriven\.\\half \[1\] is used but has no driver'

netlist pipeline <<'EOT'
module pipeline(input clk_i, rst_ni, d_i, output reg q_o);
  always @(posedge clk_i or negedge rst_ni) if (!rst_ni) q_o <= 0; else q_o <= d_i;
endmodule
EOT
refused "pipeline: found no path from flop to flop"

counter='module counter(input clk, rst_ni, output reg [3:0] q_o);
  always @(posedge clk or negedge rst_ni) if (!rst_ni) q_o <= 0; else q_o <= q_o + 4'"'"'d1;
endmodule'
netlist counter <<<"$counter"
refused "counter: found no port clk_i, expected the clock there; CLOCK=PORT names another"
netlist counter CLOCK=clk <<<"$counter"
[ $status = 0 ] || { cat "$work/told"; exit 1; }

status=0
make -s -C "$flow" BUILD="$work/build" SOURCES=/nowhere netlist >"$work/told" 2>&1 || status=$?
refused "SOURCES=/nowhere: no such file, expected a list of source files"
