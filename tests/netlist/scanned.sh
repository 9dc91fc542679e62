#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# scanned.sh MELTSTAGE FOLDER FLOW_FOLDER: puts scan into the chip's netlist of FOLDER and proves it, scan enable at 0, equal to the RTL's gates,
# whatever test mode and scan inputs say. Refuses scan with two wires of one multiplexer exchanged.
set -euo pipefail
meltstage=$1 folder=$2 flow=$3
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$meltstage" vectors scan "$folder/netlist.json" --out "$work/scan"
yosys -q -p "read_rtlil $folder/reference.il; splitnets; setattr -set named 1 w:*; write_json $work/reference.json"
prove() {
  yosys -q -p "read_json $1; setattr -set named 1 w:*; write_json $work/netlist.json"
  "$flow/prove_equal.sh" "$work/reference.json" "$work/netlist.json" tc_top none/none scan_en_i=0 scan_o=-
}
prove "$work/scan/netlist.json"
/usr/bin/python3 - "$work/scan/netlist.json" "$work/wrong.json" <<'EOT'
import json, sys
design = json.load(open(sys.argv[1], encoding="utf-8"))
pins = next(cell["connections"] for name, cell in design["modules"]["tc_top"]["cells"].items() if name.startswith("dft_scan_"))
pins["A"], pins["B"] = pins["B"], pins["A"]
json.dump(design, open(sys.argv[2], "w", encoding="utf-8"))
EOT
if prove "$work/wrong.json" >"$work/said"; then
  echo "scanned.sh: the proof does not see exchanged wires"
  exit 1
fi
grep -q 'NOT EQUIVALENT' "$work/said" || { cat "$work/said"; exit 1; }
echo "refused: exchanged wires"
