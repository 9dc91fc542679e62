#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# four_state.sh MELTSTAGE-REGRESS RTL PINS FOLDER: the RTL in four states, in Icarus. A reset at each phase of the clock leaves no flop
# unknown; the random runs of suite smoke, recorded from power-up, show the model's pins and no x. One flop without a reset is found.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
regress=$1 rtl=$2 pins=$3 folder=$4
fail() { echo "four_state.sh: $1"; exit 1; }
rm -rf "$folder"
mkdir -p "$folder"
cd "$folder"

"$rtl/to_verilog.sh" chip.v
# The first counter of the time base begins as it likes.
sed '0,/if (!rst_ni) ms_cnt_q <= /s/if (!rst_ni) ms_cnt_q <= [^;]*/if (!rst_ni) ms_cnt_q <= 14'"'"'hx/' chip.v > broken.v
cmp -s chip.v broken.v && fail "the seeded fault has no place: ms_cnt_q"

build() { iverilog -g2005 -o "$1" -s "$2" -I"$pins" "$here/$2.v" "$3"; }
build power_up.vvp power_up chip.v
build replay.vvp replay chip.v
build broken.vvp power_up broken.v

# Flops of a VCD that are x or z; "none" where it holds no flop at all.
unknown() {
  awk '$1 == "$var" && $5 ~ /_q(\[[0-9]+\])?$/ { flop[$4] = 1; seen = 1 }
       /^[bB]/ && $1 ~ /[xXzZ]/ && $2 in flop { unknown++ }
       /^[xXzZ]/ && substr($1, 2) in flop { unknown++ }
       END { print seen ? unknown + 0 : "none" }' "$1"
}
for phase in 0 1 2 3 4 5 6 7; do
  said=$(vvp -n power_up.vvp "+phase=$phase" "+vcd=chip.vcd" | grep -v '^VCD info')
  [[ $said == "phase $phase: done" ]] || fail "$said"
  [[ $(unknown chip.vcd) == 0 ]] || fail "phase $phase: $(unknown chip.vcd) flops are unknown after reset"
done
vvp -n broken.vvp +phase=0 +vcd=broken.vcd > /dev/null
(( $(unknown broken.vcd) > 0 )) || fail "a flop without reset is not found"

"$regress" regress record smoke recordings > recorded.log
runs=0
for recording in recordings/*.mvec; do
  said=$(vvp -n replay.vvp "+recording=$recording" | tail -1)
  [[ $said =~ ^[1-9][0-9]*\ clocks,\ 0\ mismatches$ ]] || fail "$recording: $said"
  runs=$((runs + 1))
done
echo "$runs runs from power-up: no mismatch, no x; resets at 8 phases leave no flop unknown"
