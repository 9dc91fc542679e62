#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Draws the charts in what `meltstage bench NAME --json` prints, a picture each: DIR/<chart's name>.svg.
#   bench_charts.sh BENCH.json DIR        (needs gnuplot)
set -euo pipefail
if [[ $# != 2 || ! -r ${1:-} || ! -d ${2:-} ]]; then
  echo "bench_charts.sh: expected BENCH.json, as meltstage bench NAME --json prints it, and a folder; found '$*'" >&2
  exit 2
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
# A gnuplot script and a file of curves for each chart.
/usr/bin/python3 - "$1" "$2" "$work" <<'PYTHON'
import json, sys
bench, folder, work = sys.argv[1:]
for chart in json.load(open(bench)).get("charts", []):
    data = f"{work}/{chart['name']}.txt"
    with open(data, "w") as out:
        for curve in chart["curves"]:
            print(f'"{curve["name"]}"', *(f"{x} {y}" for x, y in zip(curve["x"], curve["y"])), "\n", sep="\n", file=out)
    xs = [x for curve in chart["curves"] for x in curve["x"]]
    typeset = lambda text: text.replace("degC", "°C")
    print(f"""set terminal svg size 760,400 font "sans-serif,12" noenhanced background "#ffffff"
set output "{folder}/{chart['name']}.svg"
set encoding utf8
set xlabel "{typeset(chart['x_axis'])}"
set ylabel "{typeset(chart['y_axis'])}"
set xrange [{min(xs)}:{max(xs)}]
set yrange [{chart['y_min']}:{chart['y_max']}]
set grid lc rgb "#dddddd"
set key outside right top Left reverse
plot for [i=0:{len(chart['curves']) - 1}] "{data}" index i using 1:2 with lines lw (i == 0 ? 2.6 : 1.2) lc (i + 1) title columnheader(1)
""", file=open(f"{work}/{chart['name']}.gnuplot", "w"))
PYTHON
for script in "$work"/*.gnuplot; do gnuplot "$script"; done
