#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# seeded_fault.sh flipped_lut_bit|flipped_file_bit|grown_block FOLDER FPGA MELTSTAGE: passes when the flow's check finds the fault in a copy of a
# finished bitstream.
set -euo pipefail
source "${BASH_SOURCE%/*}/flip_lut_bit.sh"
fault=$1 folder=$2 fpga=$3 meltstage=$4
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cp -r "$folder/." "$work"
cd "$work"
case $fault in
flipped_lut_bit)
  flip_lut_bit "$fpga/ice40/hx8k.pcf" 'serial_o <=|assign serial_o ='
  icepack flipped.asc harness.bin
  rm -rf bitstream.v replay.txt bitstream.dir
  { make -s -C "$fpga" BOARD=hx8k TOP=tc_sysctrl REPLAY_CLOCKS=20000 out="$work" "$work/replay.txt" 2>&1 || true; } | tee log
  grep -qE "[1-9][0-9]* mismatches" log
  # the recorded vectors find it too; and are refused where they name another pin
  replay() { "$meltstage" dft replay "$1" --on fpga --readback bitstream.v --cycles 20000 >log 2>&1 && status=0 || status=$?; cat log; }
  replay harness.evcd
  [ "$status" = 1 ]
  grep -qE "20000 cycles, 20000 strobes, [1-9][0-9]* mismatches" log
  sed 's/latch_i/load_i/' harness.evcd >other.evcd
  replay other.evcd
  [ "$status" = 2 ]
  [ "$(wc -l <log)" = 1 ]
  grep -q "found other ports than the signals of other.evcd" log
  ;;
flipped_file_bit)
  printf '\x5a' | dd of=harness.bin bs=1 seek=20000 conv=notrunc status=none
  iceunpack harness.bin unpacked.asc >log 2>&1 && exit 1
  grep "CRC" log
  ;;
grown_block)
  sed -i 's/SB_LUT4 .*/SB_LUT4 99999/' cells.txt
  "$fpga/ice40/use.py" cells.txt timing.txt tc_sysctrl hx8k 2>log && exit 1
  grep "more than 5 %" log
  ;;
*)
  echo "seeded_fault.sh: no fault $fault" >&2
  exit 2
  ;;
esac
