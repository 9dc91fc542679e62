#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# routed_fault.sh removed_via|displaced_wire|shorted_nets|fast_clock|slow_cells|slow_wires FOLDER TOP FLOW TECH: passes when the check of a routed layout (make ... routed) finds
# the fault in a copy of it, in the words that fit.
set -euo pipefail
fault=$1 folder=$2 top=$3 flow=$4 tech=$5
lef=/usr/share/qflow/tech/osu018/osu018_stdcells.lef
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export QT_QPA_PLATFORM=offscreen
rules=$flow/tech/${tech}_rules.json

period=20 slower=
case $fault in
fast_clock) period=0.3 slower=1 lines=IOPATH ;; # far below the delay of its longest path
slow_cells) slower=100 lines=IOPATH ;;
slow_wires) slower=100000 lines=INTERCONNECT ;; # they are short
esac
if [ -n "$slower" ]; then
  perl -pe "/$lines/ && s/([\d.]+)::([\d.]+)/\$1 * $slower . '::' . \$2 * $slower/ge" "$folder/routed/delays_typ.sdf" >"$work/delays.sdf"
  told=$("$flow/sdf_replay.py" "$folder/reference.il" "$folder/routed/routed.v" "$work/delays.sdf" "$top" "${lef%.lef}.v" $period || true)
  echo "$told"
  grep -q ", [1-9][0-9]* mismatches" <<<"$told"
  exit
fi

# The first net of two wires or more on the third metal gets the fault.
case $fault in
removed_via) change='/^- / { net = 1 } net && !done && / M3_M2$/ { done = 1; next } { print }' ;;
displaced_wire) change='moved < 20 && /NEW metal3 \( [0-9]+ [0-9]+ \) \( [0-9]+ [0-9]+ \)$/ { $4 += 250; $8 += 250; moved++ } { print }' ;;
# one wire across the die, over all that stands on its track
shorted_nets) change='!done && /NEW metal3 \( [0-9]+ [0-9]+ \) \( [0-9]+ [0-9]+ \)$/ { $4 = 20000; $8 = 200000; done = 1 } { print }' ;;
esac
awk "$change" "$folder/routed/routed.def" >"$work/routed.def"
! cmp -s "$work/routed.def" "$folder/routed/routed.def"
klayout -b -r "$flow/gds.py" -rd rules="$rules" -rd lef="$lef" -rd routed="$work/routed.def" -rd cells= -rd gds="$work/$top.gds"
if [ "$fault" = displaced_wire ]; then
  klayout -b -r "$flow/design_rules.py" -rd rules="$rules" -rd gds="$work/$top.gds" -rd report="$work/drc.txt" -rd marks="$work/marks.lyrdb"
  cat "$work/drc.txt"
  grep -q "^metal3\|^via" "$work/drc.txt"
  exit
fi
klayout -b -r "$flow/connectivity.py" -rd rules="$rules" -rd lef="$lef" -rd netlist_of="$folder/routed/routed.def" -rd gds="$work/$top.gds" \
  -rd report="$work/lvs.txt" -rd netlist="$work/metal.v"
cat "$work/lvs.txt"
case $fault in
removed_via) grep -q "is open" "$work/lvs.txt" ;;
shorted_nets) grep -q "^short between" "$work/lvs.txt" ;;
esac
