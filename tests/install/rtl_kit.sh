#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# rtl_kit.sh BUILD FOLDER: installs the RTL into FOLDER, made anew, and uses it from there as a stranger's project does.
set -euo pipefail
build=$1 folder=$2
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
fail() { echo "rtl_kit.sh: $*" >&2; exit 1; }

rm -rf "$folder"
mkdir -p "$folder/own"
cmake --install "$build" --component rtl --prefix "$folder/prefix" > /dev/null
kit=$folder/prefix/share/meltstage/rtl
cp "$kit"/example/*.v "$folder/own"   # the stranger's own files
cd "$folder/own"

"$here/fusesoc_core.py" "$kit/meltstage.core" default lint sim

verilator --binary -j 2 --top testbench -F "$kit/tc.f" ./*.v > verilator.log 2>&1 || fail "Verilator: $(grep -m1 % verilator.log)"
! grep -m1 '^%Warning' verilator.log || fail "Verilator warns"
obj_dir/Vtestbench > verilator.said
grep -qx 'PV 215.3 degC' verilator.said || fail "Verilator says: $(cat verilator.said)"

# Flops that begin at random, and the example's sensor, too: no assertion speaks of what stood before reset.
verilator --binary -j 2 --assert --x-initial unique -Mdir random --top testbench -F "$kit/tc.f" ./*.v > random.log 2>&1 || fail "Verilator: $(grep -m1 % random.log)"
for seed in 1 2 3; do
  random/Vtestbench +verilator+rand+reset+2 "+verilator+seed+$seed" > random.said 2>&1 || fail "random start $seed: $(tail -1 random.said)"
done

"$kit/to_verilog.sh" tc_top.v
iverilog -g2005 -Wall -Ptestbench.Answers=1 -o icarus.vvp uart_master.v system.v testbench.v tc_top.v > icarus.log 2>&1 || fail "Icarus: $(head -1 icarus.log)"
[[ ! -s icarus.log ]] || fail "Icarus warns: $(head -1 icarus.log)"
vvp -n icarus.vvp > icarus.said
[[ $(cat icarus.said) == "no sample yet" && $(head -1 verilator.said) == "no sample yet" ]] || fail "Icarus says: $(cat icarus.said)"

# The folders of the kit and of the file may have a space in their names.
mkdir "a folder"
cp -r "$kit" "a folder/the kit"
"a folder/the kit/to_verilog.sh" "a folder/the chip.v"
cmp tc_top.v "a folder/the chip.v" || fail "another file in a folder with a space"

# The one file is refused where it cannot be made, and where something would be lost; nothing is left behind.
# refuses FILE WORDS
refuses() {
  ! "$kit/to_verilog.sh" "$1" 2> refusal || fail "$1 is taken"
  [[ $(wc -l < refusal) == 1 && $(cat refusal) == "to_verilog.sh: $1: $2"* ]] || fail "refusal: $(cat refusal)"
}
mkdir d
find "$kit" -type f -exec sha256sum {} + | sort > kit.before
refuses none/tc_top.v 'no such folder'
refuses d 'found a folder, expected a file'
refuses d/ 'found a folder, expected a file'
refuses /dev/null 'found no file, expected one'
ln -s "$kit/tc.f" list
for own in "$kit/tc_top.sv" "$kit/tc.f" "$kit/to_verilog.sh" "$kit/example/system.v" "$kit/properties/../tc_top.sv" list; do
  refuses "$own" 'found a file of the kit, expected another'
done
[[ -z $(ls d) ]] || fail "left in d: $(ls d)"
"$kit/to_verilog.sh" "$kit/tc_top.v"
"$kit/to_verilog.sh" "$kit/tc_top.v"  # its own earlier file may go
cmp tc_top.v "$kit/tc_top.v" || fail "another file inside of the kit"
rm "$kit/tc_top.v"
find "$kit" -type f -exec sha256sum {} + | sort | cmp - kit.before || fail "the kit has changed"
! ls ./*.partial* d/*.partial* "a folder"/*.partial* 2> /dev/null || fail "left behind"
