#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# routed_fault.sh FAULT FOLDER TOP FLOW TECH: passes when the check of a routed layout (make ... routed) finds
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

# What is missing, or failed, is a line of the summary that is not good.
case $fault in
missing_proof | failed_replay)
  mkdir -p "$work/$tech/$top"
  cp -a "$folder/." "$work/$tech/$top"
  if [ $fault = missing_proof ]; then
    rm "$work/$tech/$top/routed/equivalence.txt" # as after a proof that failed
    refused="RTL's gates = what the metal connects"
  else
    sed -i 's/, 0 mismatches/, 948 mismatches/' "$work/$tech/$top/routed/sdf.txt"
    refused="mismatches in Icarus with SDF, 2000 clocks of 20.*"
  fi
  status=0
  "$flow/summary.py" "$work/$tech" "$top" $period typ >"$work/summary" 2>"$work/told" || status=$?
  cat "$work/told"
  [ $status = 1 ] && grep -q "^$top: not good: $refused\$" "$work/told"
  exit
  ;;
esac

# Sign-off timing: what summary.py refuses.
timed=$work/$tech/$top
liberty=${lef%.lef}.lib
case $fault in
missed_setup) period=1 refused="setup slack, typ" ;;
slow_edge) # this library has no limit of its own
  sed '0,/default_operating_conditions/s//default_max_transition : 0.1; &/' "$liberty" >"$work/limited.lib"
  liberty=$work/limited.lib refused="slowest edge, typ" ;;
*) refused= ;;
esac
if [ -n "$refused" ]; then
  mkdir -p "$timed"
  cp -r "$folder/area.txt" "$folder/netlist.v" "$folder/routed" "$timed"
  FLOW=$flow LIBERTY=$liberty NETLIST=$timed/routed/routed.v TOP=$top CLOCK=clk_i PERIOD_NS=$period WIRES=$timed/routed/routed.spef DELAYS= sta -no_splash -exit "$flow/placed_timing.tcl" >"$timed/routed/timing_typ.txt" 2>&1
  touch "$timed"/*.* # in the order of making
  touch "$timed"/routed/*.*
  status=0
  "$flow/summary.py" "$work/$tech" "$top" "$period" typ >"$work/summary" 2>"$work/told" || status=$?
  cat "$work/told"
  [ $status = 1 ] && grep -q "^$top: not good: .*$refused" "$work/told"
  exit
fi

# The first net of two wires or more on the third metal gets the fault.
case $fault in
removed_via) change='pass == 1 { next } /^- / { net = 1 } net && !done && / M3_M2$/ { done = 1; next } { print }' ;;
displaced_wire) change='pass == 1 { next } moved < 20 && /NEW metal3 \( [0-9]+ [0-9]+ \) \( [0-9]+ [0-9]+ \)$/ { $4 += 250; $8 += 250; moved++ } { print }' ;;
# The first wire that has another net's wire behind it on its track reaches to that wire's end.
shorted_nets) change='/^- / { net = $2 }
  !/NEW metal3 \( [0-9]+ [0-9]+ \) \( [0-9]+ [0-9]+ \)$/ { if (pass == 2) print; next }
  pass == 1 && ($5 in first) && owner[$5] != net && $4 > far_end[$5] && !wire { wire = first[$5]; end = $8 }
  pass == 1 && !($5 in first) { first[$5] = FNR; owner[$5] = net; far_end[$5] = $8 }
  pass == 2 { if (FNR == wire) $8 = end; print }' ;;
esac
awk "$change" pass=1 "$folder/routed/routed.def" pass=2 "$folder/routed/routed.def" >"$work/routed.def"
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
