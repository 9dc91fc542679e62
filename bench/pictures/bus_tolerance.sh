#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Draws docs/pictures/bus_tolerance.svg from what `meltstage bench bus --json` prints.
#   bus_tolerance.sh BENCH.json PICTURE.svg        (needs gnuplot)
set -euo pipefail
if [[ $# != 2 || ! -r ${1:-} ]]; then
  echo "bus_tolerance.sh: expected BENCH.json, as meltstage bench bus --json prints it, and PICTURE.svg; found '$*'" >&2
  exit 2
fi
data=$(mktemp)
trap 'rm -f "$data"' EXIT
# A block a curve: its name, then host's error in %, frames lost of 1000.
/usr/bin/python3 - "$1" > "$data" <<'PYTHON'
import json, re, sys
curves = {}
for row in json.load(open(sys.argv[1]))["rows"]:
    if m := re.fullmatch(r"\d+ (\w+) jitter (\d+) %, host ([+-][\d.]+) %: lost", row["what"]):
        curves.setdefault(f"{m[1]}, jitter {m[2]} %", []).append((m[3], row["value"]))
for name, points in curves.items():
    print(f'"{name}"', *(f"{x} {y}" for x, y in points), "\n", sep="\n")
PYTHON
gnuplot <<GNUPLOT
set terminal svg size 760,420 font "sans-serif,12"
set output "$2"
set xlabel "host's clock error, %"
set ylabel "frames of 41 bytes lost, per 1000"
set xrange [-6:6]
set yrange [-20:1020]
set grid
set key center top
plot for [i=0:5] "$data" index i using 1:2 with linespoints pointsize 0.3 title columnheader(1)
GNUPLOT
