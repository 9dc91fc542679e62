#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# equivalence.sh REFERENCE.il NETLIST.v TOP LIBERTY GATE [PORT=VALUE]...: proves a netlist of library cells equal to Yosys' gates before mapping.
# Flops and clock gates are matched by name, a bit each (a[3] as a_3: layout tools know no buses), and cut; GATE and PORT=VALUE: cut_flops.py.
# Exits with 1 when they differ.
set -euo pipefail
here=$(dirname "$(realpath "$0")")
reference=$1 netlist=$2 top=$3 liberty=$4
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
yosys -q -p "read_rtlil $reference; splitnets -ports -format _; setattr -set named 1 w:*; write_json $work/reference.json"
yosys -q -w "implicitly declared" -p "read_liberty -ignore_miss_func -ignore_miss_dir $liberty; read_verilog $netlist; hierarchy -top $top; splitnets -ports -format _; setattr -set named 1 $top/w:*; flatten; opt_clean; write_json $work/netlist.json" |
  { grep -v "unsupported expression" || true; }
shift 4
"$here/prove_equal.sh" "$work/reference.json" "$work/netlist.json" "$top" "$@"
