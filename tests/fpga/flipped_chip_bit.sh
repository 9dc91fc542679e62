#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# flipped_chip_bit.sh BUILD FPGA MELTSTAGE: passes when the replay finds one flipped bit of a look-up table in a copy of the chip's bitstream.
set -euo pipefail
source "${BASH_SOURCE%/*}/flip_lut_bit.sh"
build=$1 fpga=$2 meltstage=$3
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$work/hx8k"
cp -rp "$build/hx8k/chip" "$work/hx8k"
cd "$work/hx8k/chip"
flip_lut_bit places.pcf spi_sclk_o
icepack flipped.asc board.bin
rm -rf bitstream.v replay.txt bitstream.dir
make -s -C "$fpga" BUILD="$work" BOARD=hx8k MELTSTAGE="$meltstage" chip >log 2>&1 && exit 1
grep -E "[1-9][0-9]* mismatches" log
