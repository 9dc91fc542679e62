#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# scanned.sh MELTSTAGE FOLDER FLOW_FOLDER: puts scan into the chip's netlist of FOLDER and proves it, scan enable at 0, equal to the RTL's gates,
# whatever test mode and scan inputs say. (Scan that is not off is refused on a small circuit, tests/asic/dft/scan/scan_test.cpp.)
set -euo pipefail
meltstage=$1 folder=$2 flow=$3
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$meltstage" dft scan "$folder/netlist.json" --out "$work/scan"
yosys -q -p "read_rtlil $folder/reference.il; splitnets; setattr -set named 1 w:*; write_json $work/reference.json"
yosys -q -p "read_json $work/scan/netlist.json; setattr -set named 1 w:*; write_json $work/netlist.json"
"$flow/prove_equal.sh" "$work/reference.json" "$work/netlist.json" tc_top none/none scan_en_i=0 scan_o=-
