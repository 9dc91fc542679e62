#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# equivalence.sh REFERENCE.il NETLIST.v TOP LIBERTY GATE/PIN: proves a netlist of library cells equal to Yosys' gates before mapping.
# Flops and clock gates are matched by name, a bit each (a[3] as a_3: layout tools know no buses), and cut (cut_flops.py); ABC proves
# the rest. Exits with 1 when they differ.
set -euo pipefail
here=$(dirname "$(realpath "$0")")
reference=$1 netlist=$2 top=$3 liberty=$4 gate=$5
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
yosys -q -p "read_rtlil $reference; splitnets -ports -format _; setattr -set named 1 w:*; write_json $work/reference.json"
yosys -q -w "implicitly declared" -p "read_liberty -ignore_miss_func -ignore_miss_dir $liberty; read_verilog $netlist; hierarchy -top $top; splitnets -ports -format _; setattr -set named 1 $top/w:*; flatten; opt_clean; write_json $work/netlist.json" |
  { grep -v "unsupported expression" || true; } # scan flops, which the netlist has none of
for side in reference netlist; do
  "$here/cut_flops.py" "$work/$side.json" "$top" "$gate" "$work/$side.cut.json"
  yosys -q -p "read_json $work/$side.cut.json; techmap; aigmap; opt_clean; write_aiger -zinit -symbols $work/$side.aig; write_aiger -ascii -zinit -symbols $work/$side.aag"
  # names from the text form: in the binary one the first name stands behind bytes without a line's end
  grep -E '^[io][0-9]+ ' "$work/$side.aag" | sed -E 's/^(.)[0-9]+/\1/' | sort >"$work/$side.ports"
done
if ! cmp -s "$work/reference.ports" "$work/netlist.ports"; then
  echo "equivalence.sh: flops or ports differ by name, e.g. $(diff "$work/reference.ports" "$work/netlist.ports" | sed -n 2p)"
  exit 1
fi
yosys-abc -c "cec $work/reference.aig $work/netlist.aig" >"$work/answer"
grep -E "equivalent|EQUIVALENT|Output" "$work/answer"
grep -q "Networks are equivalent" "$work/answer"
