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
flip_lut_bit places.pcf uart_tx_o
icepack flipped.asc board.bin
rm -rf bitstream.v replay.txt bitstream.dir
make -s -C "$fpga" BUILD="$work" BOARD="$board" MELTSTAGE="$meltstage" chip >log 2>&1 && exit 1
grep -E "[1-9][0-9]* mismatches" log
