#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# to_verilog.sh FILE: the chip as one file of Verilog-2005, for tools that don't read packages (Icarus 11). Modules, ports and flops keep
# their names; tc_top has its default parameters. Made by Yosys from the files of tc.f without what stands between `ifndef SYNTHESIS.
set -euo pipefail
if [[ $# -ne 1 || $1 == -* ]]; then
  echo "usage: to_verilog.sh FILE" >&2
  exit 2
fi
rtl=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
out=$(realpath -m "$1")
refuse() { echo "to_verilog.sh: $1: $2" >&2; exit 2; }
[[ ! -d $out ]] || refuse "$1" "found a folder, expected a file; give its name"
[[ ! -e $out || -f $out ]] || refuse "$1" "found no file, expected one or a new name: what is there would be replaced"
if [[ -e $out && -n $(find "$rtl" -samefile "$out") ]] && ! grep -q "^// Meltstage's chip in Verilog-2005. Made by" "$out"; then
  refuse "$1" "found a file of the kit, expected another: it would be lost"
fi
if ! command -v yosys > /dev/null; then
  echo "to_verilog.sh: yosys is not installed; on Debian: apt-get install yosys" >&2
  exit 2
fi
[[ -d $(dirname "$out") ]] || refuse "$1" "no such folder; make it first"
trap 'rm -f "$out.partial" "$out.partial.raw"' EXIT
# In the kit's folder and to the standard output: a path in a command of Yosys may have no space.
(cd "$rtl" && yosys -q -p "read_verilog -sv -DSYNTHESIS -I. $(grep -v '^+' tc.f | tr '\n' ' '); hierarchy -check -top tc_top; proc; opt_clean
  write_verilog -noattr") > "$out.partial.raw" || { echo "to_verilog.sh: yosys refuses the RTL" >&2; exit 2; }
# Yosys names a module with parameters after their values; here it has its own name, and a number where there are several.
{
  echo "// SPDX-License-Identifier: Apache-2.0"
  echo "// Meltstage's chip in Verilog-2005. Made by to_verilog.sh with $(yosys -V | cut -d' ' -f1,2); don't edit."
  echo "// verilator lint_off CASEOVERLAP"
  echo "// verilator lint_off UNOPTFLAT"
  echo "// verilator lint_off WIDTH"
  awk '
    function plain(name) { match(name, /\\tc_[a-z_]+/); return substr(name, RSTART + 1, RLENGTH - 1) }
    FNR == NR { if ($1 == "module" && $2 ~ /^\\\$paramod/) number[$2] = ++count[plain($2)]; next }
    { for (i = 1; i <= 2; i++) if ($i in number) $i = plain($i) (count[plain($i)] > 1 ? "_" number[$i] : "") }
    { sub(/ *\/\/ synopsys parallel_case/, ""); print }
  ' "$out.partial.raw" "$out.partial.raw" | tail -n +2
} > "$out.partial"
mv "$out.partial" "$out"
