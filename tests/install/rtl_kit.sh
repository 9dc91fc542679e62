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

"$kit/to_verilog.sh" tc_top.v
iverilog -g2005 -Wall -Ptestbench.Answers=1 -o icarus.vvp uart_master.v system.v testbench.v tc_top.v > icarus.log 2>&1 || fail "Icarus: $(head -1 icarus.log)"
[[ ! -s icarus.log ]] || fail "Icarus warns: $(head -1 icarus.log)"
vvp -n icarus.vvp > icarus.said
[[ $(cat icarus.said) == "no sample yet" && $(head -1 verilator.said) == "no sample yet" ]] || fail "Icarus says: $(cat icarus.said)"

# The one file is refused where it cannot be made, and nothing is left behind.
! "$kit/to_verilog.sh" none/tc_top.v 2> refusal || fail "a folder that isn't there is taken"
grep -q 'none/tc_top.v: no such folder' refusal || fail "refusal: $(cat refusal)"
