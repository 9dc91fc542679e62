#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# foreign_design.sh FLOW PLACER ROUTER: a design with other names and habits than the chip's goes from RTL to a layout that is proved, timed and
# replayed: a clocked reset, active high; flops without one; an output that is a constant, and one that is an input; names of generate blocks.
# With a flop changed in the routed netlist, the replay finds it.
set -euo pipefail
flow=$1 placer=$2 router=$3
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
unset MAKEFLAGS MAKELEVEL
cat >"$work/lanes.v" <<'EOT'
module lanes(input clk, i_rst, input [1:0] i_en, input [7:0] i_data, output [7:0] o_sum, output o_one, output o_through, output reg o_busy);
  genvar lane;
  generate
    for (lane = 0; lane < 2; lane = lane + 1) begin : g_lane
      reg [3:0] held, count;  // held has no reset
      always @(posedge clk) begin
        if (i_en[lane]) held <= i_data[4 * lane +: 4] + count;
        count <= i_rst ? 4'd0 : count + held;
      end
    end
  endgenerate
  always @(posedge clk) if (i_rst) o_busy <= 1'b0; else o_busy <= |i_en ^ o_busy;
  assign o_sum = {g_lane[1].held, g_lane[0].held} ^ {g_lane[0].count, g_lane[1].count};
  assign o_one = 1'b1;
  assign o_through = i_data[3];
endmodule
EOT
echo lanes.v >"$work/files"
make -s -C "$flow" BUILD="$work" TECH=osu018 SOURCES="$work/files" TOP=lanes CLOCK=clk RESET=i_rst=1 PLACER="$placer" ROUTER="$router" routed >"$work/told" 2>&1 ||
  { cat "$work/told"; exit 1; }
for row in "RTL's gates = netlist +proved" "RTL's gates = what the metal connects +proved" "mismatches in Icarus with SDF, 2000 clocks of 20.0 ns +0$" \
  "(DRC|LVS) errors +0$" "setup slack, typ +[0-9.]+ ns"; do
  grep -qE "$row" "$work/told" || { echo "foreign_design.sh: the summary lacks: $row"; cat "$work/told"; exit 1; }
done

routed=$work/osu018/lanes/routed
awk '/DFFPOSX1/ && !done { in_flop = 1 } in_flop && /\.D\(/ { sub(/\.D\([^)]*\)/, ".D(i_data_0)"); done = 1; in_flop = 0 } { print }' "$routed/routed.v" >"$work/wrong.v"
! cmp -s "$routed/routed.v" "$work/wrong.v"
status=0
"$flow/sdf_replay.py" "$work/osu018/lanes/reference.il" "$work/wrong.v" "$routed/delays_typ.sdf" lanes /usr/share/qflow/tech/osu018/osu018_stdcells.v 20 \
  --clock clk --reset i_rst=1 >"$work/told" 2>&1 || status=$?
[ $status = 1 ] && grep -qE "2000 clocks of 20.0 ns, [1-9][0-9]* mismatches" "$work/told" || { cat "$work/told"; exit 1; }
