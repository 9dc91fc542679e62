#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# test_pins.sh RTL_FOLDER FLOW_FOLDER EFFECTS: proves that the chip with its test pins at 0 is the chip without them, whatever scan_i says; and that
# the proof refuses RTL in which they have an effect (EFFECTS of those below, drawn at random). Blocks that don't have the pins are kept whole,
# equal on both sides.
set -euo pipefail
rtl=$1 flow=$2 effects=$3
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
files=$(grep "^tc_" "$rtl/tc.f")   # rtl/properties/ is empty in synthesis
pins='test_mode_i scan_en_i scan_i'

# elaborate RTL NAME COMMANDS: the top with the blocks that have the pins, each bit by itself.
elaborate() {
  local whole=
  for file in $files; do
    case $file in tc_top.sv | tc_mem.sv | tc_sysctrl.sv | tc_rst_sync.sv | tc_sync.sv | *_pkg.sv) continue ;; esac
    ! grep -qE 'scan_|test_mode' "$1/$file" || { echo "test_pins.sh: $file has test pins; let the proof look into it"; exit 1; }
    whole+=" *${file%.sv}*"
  done
  (cd "$1" && yosys -q -p "read_verilog -sv -DSYNTHESIS -I. $(echo $files); hierarchy -check -top tc_top; blackbox$whole; proc; flatten; memory_map; opt_clean
    simplemap; techmap; simplemap; opt_clean; dfflegalize -cell \$_DFF_PN0_ 01 -cell \$_DFF_PN1_ 01; opt_clean
    splitnets -ports -format _; setattr -set named 1 w:*_q*; $3; write_json $work/$2.json")
}
prove() { "$flow/prove_equal.sh" "$work/$1.json" "$work/without.json" tc_top none/none test_mode_i=0 scan_en_i=0 scan_o=-; }
# change NAME FILE SED: a copy of the RTL with a line changed
change() {
  cp -r "$rtl" "$work/$1"
  sed -i "$3" "$work/$1/$2"
  ! cmp -s "$rtl/$2" "$work/$1/$2" || { echo "test_pins.sh: $1: the change no longer applies to $2"; exit 1; }
}

# Without the pins: they lead nowhere, which Yosys confirms.
change rtl_without tc_rst_sync.sv 's/test_mode_i ? rst_ni : out_q/out_q/'
sed -i 's/ *|| scan_en_i//; s/ | {Columns{scan_en_i}}//' "$work/rtl_without/tc_mem.sv"
sed -i 's/test_mode_i ? TestMsLast : MsLast/MsLast/; s/ || test_mode_i;/;/' "$work/rtl_without/tc_sysctrl.sv"
elaborate "$work/rtl_without" without "select -assert-none w:test_mode_i w:scan_en_i w:scan_i_* %u %u %co1 c:* %i"
elaborate "$rtl" chip ""
prove chip

# Each of these is an effect in function.
while IFS=$'\t' read -r name file edit; do
  change "$name" "$file" "$edit"
  elaborate "$work/$name" "$name" ""
  if prove "$name" >"$work/said"; then
    echo "test_pins.sh: the proof does not see: $name"
    exit 1
  fi
  grep -q 'NOT EQUIVALENT' "$work/said" || { cat "$work/said"; exit 1; }
  echo "refused: $name"
done < <(shuf -n "$effects" <<'EOT'
bypass_always	tc_rst_sync.sv	s/test_mode_i ? rst_ni : out_q/test_mode_i ? out_q : rst_ni/
times_short	tc_sysctrl.sv	s/7'd99 || test_mode_i/7'd99 || !test_mode_i/
words_open	tc_mem.sv	s/| {Columns{scan_en_i}}/| {Columns{!scan_en_i}}/
chain_into_pin	tc_top.sv	s/{drop_i, inhibit_i/{drop_i ^ scan_i[0], inhibit_i/
EOT
)
