#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# prove_equal.sh REFERENCE.json NETLIST.json TOP GATE [PORT=VALUE]...: proves two flat netlists of Yosys' own cells equal. Flops and clock gates
# are matched by the names of their nets and cut; GATE, PORT=VALUE and the attribute the nets need: cut_flops.py. ABC proves the rest.
# Exits with 1 when they differ.
set -euo pipefail
here=$(dirname "$(realpath "$0")")
top=$3 gate=$4
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cp "$1" "$work/reference.json"
cp "$2" "$work/netlist.json"
shift 4
for side in reference netlist; do
  "$here/cut_flops.py" "$work/$side.json" "$top" "$gate" "$work/$side.cut.json" "$@"
  yosys -q -p "read_json $work/$side.cut.json; techmap; aigmap; opt_clean; write_aiger -zinit -symbols $work/$side.aig; write_aiger -ascii -zinit -symbols $work/$side.aag"
  # names from the text form: in the binary one the first name stands behind bytes without a line's end
  grep -E '^[io][0-9]+ ' "$work/$side.aag" | sed -E 's/^(.)[0-9]+/\1/' | sort >"$work/$side.ports"
done
if ! cmp -s "$work/reference.ports" "$work/netlist.ports"; then
  echo "prove_equal.sh: flops or ports differ by name, e.g. $(diff "$work/reference.ports" "$work/netlist.ports" | sed -n 2p)"
  exit 1
fi
yosys-abc -c "cec $work/reference.aig $work/netlist.aig" >"$work/answer"
grep -E "equivalent|EQUIVALENT|Output" "$work/answer"
grep -q "Networks are equivalent" "$work/answer"
