#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# print_windows.sh MELTSTAGE JOB.toml NETLIST_FOLDER FLOW_FOLDER: the chip's netlist with scan goes on in the middle of a print, the model's flops shifted
# into its chains, and must have the recorded pins and end with the model's flops. A flop loaded, or expected, wrong must be found.
set -euo pipefail
meltstage=$1 job=$2 folder=$3 flow=$4
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
"$meltstage" dft scan "$folder/netlist.json" --out scan > scan.log
yosys -q -p "read_rtlil $folder/reference.il; json -o flops.json t:\$_DFF* t:\$_NOT_ w:*"
# wrong input is one line and 2
for wrong in "$job 60" "nosuch.toml 0.005"; do
  status=0
  python3 -B "$flow/print_windows.py" "$meltstage" ${wrong% *} flops.json scan/scan.json wrong ${wrong#* } 2> wrong.txt || status=$?
  if [ $status != 2 ] || [ "$(wc -l < wrong.txt)" != 1 ]; then cat wrong.txt >&2; exit 1; fi
done
python3 -B "$flow/print_windows.py" "$meltstage" "$job" flops.json scan/scan.json windows 0.005
yosys -q -p 'read_json scan/netlist.json; techmap -map +/simcells.v t:$_BUF_; write_verilog -noattr flat.v' > yosys.log 2>&1
# -fno-const-bit-op-tree: asic/flow/Makefile says why
verilator --cc --exe --build -j 2 --prefix Vnetlist --top-module tc_top -Wno-lint -Wno-fatal -fno-const-bit-op-tree --x-assign 0 --x-initial 0 -CFLAGS "-std=c++20 -I$flow/../.." -LDFLAGS "-lfmt -lcrypto" \
  --output-split 20000 -MAKEFLAGS "OPT_FAST=-O0 OPT_SLOW=-O0" --Mdir replay.dir flat.v "$flow/replay.cpp" \
  "$flow"/../../recording/*.cpp "$flow"/../../base/{file,output_file,place,sha256}.cpp "$flow/../../tb/pins/chip_pins.cpp" -o replay > verilator.log
for phase in heat-up print; do
  ./replay.dir/replay "windows/$phase.mvec" | tee "$phase.txt"
  grep -q "^60000 clocks, 0 mismatches$" "$phase.txt"
done
for kind in load unload; do
  # from the hundredth line on the first 0 that there is becomes 1
  awk -v kind=$kind '$1 == kind && ++n >= 100 && !done { done = sub("0", "1", $2) } { print }' windows/print.scan > wrong.scan
  ! cmp -s windows/print.scan wrong.scan
  cp windows/print.mvec wrong.mvec
  if ./replay.dir/replay wrong.mvec; then echo "a wrong bit of $kind was not found" >&2; exit 1; fi
done
