#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# flipped_chip_bit.sh BOARD BUILD FPGA MELTSTAGE: passes when the replay finds one flipped bit of a look-up table in a copy of the chip's bitstream.
set -euo pipefail
source "${BASH_SOURCE%/*}/flip_lut_bit.sh"
board=$1 build=$2 fpga=$3 meltstage=$4
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$work/$board"
cp -rp "$build/$board/chip" "$work/$board"
cd "$work/$board/chip"
# Of a table with one input that toggles every bit that can be reached matters; of a larger one's some may stand for what never happens.
flip_lut_bit places.pcf '= /\* LUT [ 0-9]*\*/ uart_rx_i;'
icepack flipped.asc board.bin
rm -rf bitstream.v replay.txt bitstream.dir
make -s -C "$fpga" BUILD="$work" BOARD="$board" MELTSTAGE="$meltstage" chip >log 2>&1 && exit 1
grep -E "[1-9][0-9]* mismatches" log
