#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# keeps_inputs.sh PLACE ROUTE: neither program writes over a file that it reads, nor two outputs into one file; what they can't do is told in
# one line that names the file or the option, with exit status 2, and nothing is written.
set -euo pipefail
place=$1 route=$2
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"

cat > cells.lef <<'END'
LAYER m1 TYPE ROUTING ; DIRECTION HORIZONTAL ; PITCH 1 ; OFFSET 0.5 ; WIDTH 0.3 ; SPACING 0.2 ; END m1
LAYER v1 TYPE CUT ; SPACING 0.3 ; END v1
LAYER m2 TYPE ROUTING ; DIRECTION VERTICAL ; PITCH 0.8 ; WIDTH 0.3 ; SPACING 0.3 ; END m2
LAYER v2 TYPE CUT ; SPACING 0.3 ; END v2
LAYER m3 TYPE ROUTING ; DIRECTION HORIZONTAL ; PITCH 1 ; WIDTH 0.3 ; SPACING 0.3 ; END m3
VIA M3_M2 DEFAULT LAYER m2 ; RECT -0.2 -0.2 0.2 0.2 ; LAYER v2 ; RECT -0.1 -0.1 0.1 0.1 ; LAYER m3 ; RECT -0.2 -0.2 0.2 0.2 ; END M3_M2
VIA M2_M1 DEFAULT LAYER m1 ; RECT -0.2 -0.2 0.2 0.2 ; LAYER v1 ; RECT -0.1 -0.1 0.1 0.1 ; LAYER m2 ; RECT -0.2 -0.2 0.2 0.2 ; END M2_M1
SITE core CLASS CORE ; SYMMETRY Y ; SIZE 0.8 BY 10 ; END core
MACRO INV CLASS CORE ; ORIGIN 0 0 ; SIZE 1.6 BY 10 ; SYMMETRY X Y ; SITE core ;
  PIN A DIRECTION INPUT ; USE SIGNAL ; PORT LAYER m1 ; RECT 0 1 0.4 2 ; END END A
  PIN Y DIRECTION OUTPUT ; USE SIGNAL ; PORT LAYER m1 ; RECT 1.2 3 1.6 4 ; END END Y
  PIN vdd DIRECTION INOUT ; USE POWER ; PORT LAYER m1 ; RECT 0 9.7 1.6 10.3 ; END END vdd
  PIN gnd DIRECTION INOUT ; USE GROUND ; PORT LAYER m1 ; RECT 0 -0.3 1.6 0.3 ; END END gnd
END INV
END LIBRARY
END
cat > two.def <<'END'
DESIGN two ;
UNITS DISTANCE MICRONS 1000 ;
DIEAREA ( 0 0 ) ( 20000 20000 ) ;
ROW ROW_0 core 800 0 FS DO 20 BY 1 STEP 800 0 ;
COMPONENTS 2 ;
- u1 INV + PLACED ( 800 0 ) FS ;
- u2 INV + FIXED ( 8000 0 ) S ;
END COMPONENTS
PINS 1 ;
- a + NET a + DIRECTION INPUT + USE SIGNAL + LAYER m2 ( -150 850 ) ( 150 1150 ) + PLACED ( 400 0 ) N ;
END PINS
NETS 2 ;
- a ( PIN a ) ( u1 A ) ;
- n ( u1 Y ) ( u2 A ) ;
END NETS
END DESIGN
END
cat > two.json <<'END'
{"modules": {"two": {"attributes": {"top": "1"}, "ports": {"a": {"direction": "input", "bits": [2]}, "y": {"direction": "output", "bits": [3]}},
  "cells": {"u": {"type": "INV", "connections": {"A": [2], "Y": [3]}}}, "netnames": {}}}}
END
ln -s two.def link.def
sed 's/PLACED ( 400 0 )/PLACED ( 1200 0 )/' two.def > beside.def
sed 's/( 8000 0 )/( 8000000 0 )/' two.def > outside.def
sed 's/FIXED ( 8000 0 ) S/FIXED ( 800 0 ) S/' two.def > overlap.def
sed 's/( 8000 0 ) S/( 8100 0 ) S/' two.def > off_site.def
sed 's/ ( u2 A )//' two.def > floating.def
sed 's/( u2 A ) ;/( u2 A ) + FIXED m2 ( 8400 500 ) ( * 2500 ) ;/' two.def > wired.def
sed 's/^NETS 2 ;/SPECIALNETS 1 ;\n- VDD ( * VDD ) + ROUTED m2 400 ( 900 0 ) ( * 20000 ) + USE POWER ;\nEND SPECIALNETS\n&/' two.def > strapped.def
sed '/LAYER m2 TYPE/ s/SPACING 0.3 ;//' cells.lef > no_spacing.lef
grep -v 'm3\|v2' cells.lef > two_layers.lef
: > empty.lef
printf 'VERSION 5.8 ;\nDESIGN d ;\nUNITS DISTANCE MICRONS 1000 ;\nDIEAREA ( 0 0 ) ( 1000 1000 ) ;\nEND DESIGN\n' > empty.def
lib() { printf 'library(l) { %s }\n' "$1" > "$2"; }
lib 'cell(OTHER) { pin(A) { capacitance : 1; } }' other.lib
lib 'cell(INV) { pin(A) { rise_capacitance : 1; } }' bare.lib
lib 'cell(INV) { pin(A) { capacitance : 1; } }' no_flop.lib
lib 'time_unit : "1ps"; cell(INV) { pin(A) { capacitance : 1; } }' ps.lib
sha256sum ./* > before

# refused FOUND COMMAND...: the answer is one line with FOUND, and no file is another or new
refused() {
  local found=$1 status=0
  shift
  "$@" > told 2>&1 || status=$?
  [[ $status == 2 && $(wc -l < told) == 1 && $(< told) == *"$found"* ]] ||
    { echo "FAILED: $*: found status $status and: $(< told); expected 2 and one line with: $found" >&2; exit 1; }
  rm told
  sha256sum --quiet -c before && [[ $(find . ! -type d | wc -l) == $(($(wc -l < before) + 1)) ]] ||
    { echo "FAILED: $*: files were written: $(ls)" >&2; exit 1; }
}

r=("$route" --lef cells.lef --def two.def)
p=("$place" --lef cells.lef --netlist two.json)
refused 'two.def: would be written over the input' "${r[@]}" --out two.def
refused 'link.def: would be written over the input' "${r[@]}" --out link.def
refused 'cells.lef: would be written over the input' "${r[@]}" --out ./cells.lef
for option in netlist spef report; do
  refused 'two.def: would be written over the input' "${r[@]}" --out new.def --$option two.def
  refused 'new.def: would be written twice' "${r[@]}" --out new.def --$option new.def
done
for option in def spef verilog; do
  refused 'two.json: would be written over the input' "${p[@]}" --$option two.json
  refused 'cells.lef: would be written over the input' "${p[@]}" --$option cells.lef
done
refused 'new: would be written twice' "${p[@]}" --def new --spef new
refused 'two.def: would be written over the input' "$place" --lef cells.lef --netlist two.json --liberty two.def --def two.def
refused 'outside.def:7:3: found "u2", expected a component within DIEAREA' "$place" --lef cells.lef --again outside.def
refused 'overlap.def: found cells of 2 times the area that they lie in' "$place" --lef cells.lef --again overlap.def
refused 'beside.def:10:3: found pin a beside the tracks of m2, expected it on one' "$route" --lef cells.lef --def beside.def --out new.def
refused 'two_layers.lef: found 2 routing layers, expected three or more' "$route" --lef two_layers.lef --def two.def --out new.def
refused 'empty.lef: found 0 routing layers, expected three or more' "$route" --lef empty.lef --def empty.def --out new.def
refused '--report: found nothing' "$route" --lef cells.lef --def two.def --out new.def --report ''
refused 'missing\x1B[31m.lef' "$route" --lef $'missing\e[31m.lef' --def two.def --out new.def
refused 'overlap.def:7:3: found u1 and u2: overlap, expected cells side by side' "$route" --lef cells.lef --def overlap.def --out new.def
refused 'off_site.def:7:3: found u2: at x = 8100 nm, not on the sites of ROW_0' "$route" --lef cells.lef --def off_site.def --out new.def
refused 'floating.def:7:3: found u2/A in no net, expected each input of a cell in one' "$route" --lef cells.lef --def floating.def --out new.def
refused '--fanout: Value 0 not in range 2 to 1000000' "${p[@]}" --def new.def --fanout 0
refused 'strapped.def: found that pin a is at a strap of VDD on m2; expected supplies, pins of the die' "$route" --lef cells.lef --def strapped.def --out new.def
refused '--spef: found no RESISTANCE or no CAPACITANCE of layer m1 in cells.lef' "$route" --lef cells.lef --def two.def --out new.def --spef new.spef
clock=("$place" --lef cells.lef --netlist two.json --def new.def --clock a --buffers INV --liberty)
refused 'other.lib: found no cell INV, expected each cell of the netlist' "${clock[@]}" other.lib
refused 'bare.lib: cell INV: found no capacitance of pin A' "${clock[@]}" bare.lib
refused 'no_flop.lib: found no flop (ff) and no clock gate' "${clock[@]}" no_flop.lib
refused 'ps.lib:1:14: found time_unit 1ps, expected 1ns' "${clock[@]}" ps.lib
refused 'wired.def:14:31: found wires of net n, expected none' "$route" --lef cells.lef --def wired.def --out new.def
refused 'no_spacing.lef: found no SPACING of layer m2 that holds' "$route" --lef no_spacing.lef --def two.def --out new.def
refused 'empty.lef: found no pin with USE POWER, expected MACROs' "$place" --lef empty.lef --netlist two.json --def new.def
for option in --def --verilog --spef --utilization; do
  "$place" --lef cells.lef --again two.def $option 0.5 > told 2>&1 && { echo "FAILED: --again takes $option" >&2; exit 1; }
  grep -q -- "$option" told || { echo "FAILED: --again with $option: found $(< told)" >&2; exit 1; }
done
"$place" --lef cells.lef --again two.def > told
grep -q 'placement errors	0' told
