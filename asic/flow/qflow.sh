#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# qflow.sh FOLDER TOP TECH_FOLDER: lays out FOLDER/netlist.v with qflow's own steps, into FOLDER/layout. Each step that ended well is not
# run again while its input is unchanged. Writes place.txt, route.txt, drc.txt and lvs.txt: what was found, in qflow's words.
set -euo pipefail
folder=$1 top=$2 tech=$3
scripts=/usr/lib/qflow/scripts
project=$folder/layout
mkdir -p "$project"/{source,synthesis,layout,log,done}
export QT_QPA_PLATFORM=offscreen
unset DISPLAY

# step NAME INPUT COMMAND...: its log is log/NAME.txt
step() {
  local name=$1 input=$2
  shift 2
  [ "$project/done/$name" -nt "$input" ] && return 0
  [ -t 2 ] && echo "$top: $name" >&2
  if ! "$@" >"$project/log/$name.txt" 2>&1; then
    echo "$top: $name failed: $(grep -iE 'error|fail' "$project/log/$name.txt" | head -n1) (all of it: $project/log/$name.txt)" >&2
    exit 1
  fi
  touch "$project/done/$name"
}

cat >"$project/qflow_vars.sh" <<VARS
#!/usr/bin/tcsh -f
set qflowversion=1.3
set projectpath=$project
set techdir=$tech
set sourcedir=$project/source
set synthdir=$project/synthesis
set layoutdir=$project/layout
set techname=$(basename "$tech")
set scriptdir=$scripts
set bindir=/usr/lib/qflow/bin
set synthlog=$project/synth.log
VARS
cat >"$project/project_vars.sh" <<'VARS'
set yosys_options="-q -s mapped.ys"
set initial_density=0.75
set graywolf_options="-n"
VARS
# qflow's synthesis script buffers by load and writes its netlists; the mapping has been done. One port a bit: its tools know no buses.
echo "module $top; endmodule" >"$project/source/$top.v"
cat >"$project/source/mapped.ys" <<YOSYS
read_liberty -lib -ignore_miss_dir -setattr blackbox $tech/osu018_stdcells.lib
read_verilog $folder/netlist.v
hierarchy -top $top
splitnets -ports -format _
opt_clean
write_blif -buf BUFX2 A Y ${top}_mapped.blif
YOSYS
cp "$tech/osu018.par" "$project/layout/$top.par"
cp "$tech/osu018.magicrc" "$project/layout/.magicrc"

step synthesize "$folder/netlist.v" "$scripts/synthesize.sh" "$project" "$top"
step placement "$project/done/synthesize" "$scripts/placement.sh" -d "$project" "$top"
step router "$project/done/placement" "$scripts/router.sh" "$project" "$top"
step migrate "$project/done/router" "$scripts/migrate.sh" "$project" "$top"
step drc "$project/done/migrate" "$scripts/drc.sh" "$project" "$top"
step lvs "$project/done/migrate" "$scripts/lvs.sh" "$project" "$top"
# Debian ships no layout inside the cells: the abstracts of the LEF stand in their place.
cat >"$project/layout/gds.tcl" <<MAGIC
drc off
lef read $tech/osu018_stdcells.lef
load $top
select top cell
expand
gds write $folder/layout/$top.gds
quit -noprompt
MAGIC
in_layout() { (cd "$project/layout" && "$@" </dev/null); }
step gds "$project/done/migrate" in_layout magic -dnull -noconsole gds.tcl

# named power nets are constants to whoever reads the netlist without them
sed 's/(vdd)/(1'"'"'b1)/g; s/(gnd)/(1'"'"'b0)/g' "$project/synthesis/$top.rtlnopwr.v" >"$folder/layout/routed.v"
/usr/lib/qflow/bin/rc2dly -r "$project/layout/$top.rc" -l "$tech/osu018_stdcells.lib" -d "$folder/layout/$top.sdf" >"$project/log/rc2dly.txt"
grep -E "DIEAREA|ROW " "$project/layout/$top.def" >"$folder/layout/place.txt"
grep -E "Final:|Total wire length|Progress" "$project/log/router.txt" | tail -n 3 >"$folder/layout/route.txt"
grep -E "drc *=" "$project/log/drc.txt" >"$folder/layout/drc.txt"
grep -E "match|Total errors" "$project/log/lvs.txt" >"$folder/layout/lvs.txt"
