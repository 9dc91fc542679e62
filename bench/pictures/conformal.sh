#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Draws the pictures of docs/motion/conformal.md from what `meltstage bench conformal --json` prints.
#   conformal.sh BENCH.json DIR        (needs gnuplot)
set -euo pipefail
if [[ $# != 2 || ! -r ${1:-} || ! -d ${2:-} ]]; then
  echo "conformal.sh: expected BENCH.json, as meltstage bench conformal --json prints it, and a folder; found '$*'" >&2
  exit 2
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
/usr/bin/python3 - "$1" "$2" "$work" <<'PYTHON'
import json, sys
bench, folder, work = sys.argv[1:]
charts = {c["name"]: c for c in json.load(open(bench))["charts"]}
for name, chart in charts.items():
    with open(f"{work}/{name}.txt", "w") as out:
        for curve in chart["curves"]:
            print(f'"{curve["name"]}"', *(f"{x:.4g} {y:.4g}" for x, y in zip(curve["x"], curve["y"])), "\n", sep="\n", file=out)

def head(name, width, height):
    return f"""set terminal svg size {width},{height} font "sans-serif,12" noenhanced background "#ffffff"
set output "{folder}/{name}.svg"
set encoding utf8
set grid lc rgb "#dddddd"
"""

# Both groups side by side, seen from above, widths true to scale.
with open(f"{work}/lines.gnuplot", "w") as out:
    print(head("conformal_lines", 900, 640) + """unset key
unset grid
set size ratio -1
set xrange [0:40]
set yrange [0:60]
set xlabel "x, mm"
set ylabel "y, mm"
set style fill solid 1.0 noborder
set multiplot layout 1,2""", file=out)
    for name, title in (("conformal_before", "without compensation"), ("conformal_after", "with ours")):
        curves = charts[name]["curves"]
        print(f'set title "{title}"', file=out)
        labels = [f'set label {i + 1} "{i + 1}" at 37.5,{c["y"][len(c["y"]) // 2]:.2f} left' for i, c in enumerate(curves)]
        print("\n".join(labels), file=out)
        print(f'plot for [i=0:{len(curves) - 1}] "{work}/{name}.txt" index i every 2 using 1:2 with filledcurves closed lc rgb "#555a60"',
              file=out)
    print("unset multiplot", file=out)

COLOURS = {"ours": "#0060ad", "before": "#b0b0b0", "paper's compensation": "#dd181f", "paper's rule": "#dd181f",
           "stringing begins": "#000000"}

def panels(picture, names, height):
    with open(f"{work}/{picture}.gnuplot", "w") as out:
        print(head(picture, 820, height * len(names)) + f"set multiplot layout {len(names)},1\nset key outside right top Left reverse", file=out)
        for name in names:
            chart = charts[name]
            print(f"""set xlabel "{chart['x_axis']}"
set ylabel "um"
set xrange [0:{max(max(c['x']) for c in chart['curves']):.3f}]
set title "{chart['y_axis']}"
set yrange [{chart['y_min']}:{chart['y_max']}]""", file=out)
            parts = []
            for i, curve in enumerate(chart["curves"]):
                touches = curve["name"].endswith(", touches")
                whose = curve["name"].removesuffix(", touches")
                # The paper's touches a little below, so that both are seen.
                shift = 0 if whose == "ours" else 0.06 * (chart["y_max"] - chart["y_min"])
                every = 1 if len(curve["x"]) < 100 else 4
                style = "points pt 7 ps 0.5" if touches else f"lines lw {2.4 if whose == 'ours' else 1.4}"
                parts.append(f'"{work}/{name}.txt" index {i} every {every} using 1:($2-{shift if touches else 0}) with {style} '
                             f'lc rgb "{COLOURS[whose]}" title columnheader(1)')
            print("plot " + ", ".join(parts), file=out)
        print("unset multiplot", file=out)

panels("conformal_gaps", [n for n in charts if n.startswith("conformal_gap_")], 240)
panels("conformal_points", [n for n in charts if n.startswith("conformal_points_")], 220)
PYTHON
for script in "$work"/*.gnuplot; do gnuplot "$script"; done
