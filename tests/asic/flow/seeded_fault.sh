#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# seeded_fault.sh wrong_cell|open_wire|thin_space|slow_clock FOLDER TOP FLOW: passes when the flow's check finds the fault in a copy of a
# finished layout.
set -euo pipefail
fault=$1 folder=$2 top=$3 flow=$4
liberty=/usr/share/qflow/tech/osu018/osu018_stdcells.lib
scripts=/usr/lib/qflow/scripts
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cp -r "$folder/." "$work"
project=$work/layout

# Reads the changed DEF into magic, as the flow does after routing, and runs CHECK on it.
again() {
  sed -i "s#$folder/layout#$project#g" "$project/qflow_vars.sh" "$project/layout/.magicrc"
  "$scripts/migrate.sh" "$project" "$top" >"$work/log" 2>&1
  "$scripts/$1.sh" "$project" "$top" >>"$work/log" 2>&1 || true
}
def=$project/layout/$top.def
case $fault in
wrong_cell)
  sed -i '0,/NAND2X1 /s//NOR2X1 /' "$work/netlist.v"
  ! "$flow/equivalence.sh" "$work/reference.il" "$work/netlist.v" "$top" "$liberty" none/none
  ;;
open_wire)
  sed -i '0,/^  NEW metal3 .*$/s///' "$def"
  again lvs
  ! grep -q "Total errors = 0" "$work/log"
  ;;
thin_space)
  # a wire 0.5 um to the side of its vias
  awk '!done && /NEW metal3 \( [0-9]+ [0-9]+ \) \( [0-9]+ \* \)/ { $5 += 50; done = 1 } { print }' "$def" >"$work/def"
  mv "$work/def" "$def"
  again drc
  ! grep -q "drc = 0" "$work/log"
  ;;
slow_clock)
  # far below the delay of its longest path
  ! "$flow/sdf_replay.py" "$work/reference.il" "$work/layout/routed.v" "$work/layout/delays.sdf" "$top" /usr/share/qflow/tech/osu018/osu018_stdcells.v 0.3
  ;;
*)
  echo "seeded_fault.sh: no fault $fault" >&2
  exit 2
  ;;
esac
