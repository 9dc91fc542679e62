# shellcheck shell=bash
# SPDX-License-Identifier: Apache-2.0
# Sourced. flip_lut_bit PLACES CELL: flipped.asc from unpacked.asc, with one bit changed in a look-up table: the first bit that can be reached of the one
# whose line in bitstream.v (its own, or its flop's) matches the regular expression CELL.
flip_lut_bit() {
  local places=$1 cell=$2 x y n column before
  read -r x y n < <(grep -E "$cell" bitstream.v | sed -nE 's#.*/\* (FF|LUT) +([0-9]+) +([0-9]+) +([0-9]+) \*/.*#\2 \3 \4#p')
  table() { icebox_vlog -s -n bitstream -p "$places" "$1" | grep "LUT  *$x  *$y  *$n "; }
  before=$(table unpacked.asc) # some seconds
  for column in 37 38 39 40 41 42 43 44 45 46; do
    awk -v x="$x" -v y="$y" -v line="$((2 * n + 1))" -v column="$column" '
      /^\./ { inside = ($1 == ".logic_tile" && $2 == x && $3 == y); at = 0 }
      inside && ++at == line + 1 { bit = substr($0, column, 1); $0 = substr($0, 1, column - 1) (1 - bit) substr($0, column + 1) }
      { print }' unpacked.asc >flipped.asc
    [ "$(table flipped.asc)" = "$before" ] || return 0
  done
  return 1
}
