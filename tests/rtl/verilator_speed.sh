#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# verilator_speed.sh [RECORDING]: speed of the Verilated RTL under different flags, a line each (docs/verify/bench.md). RECORDING defaults to
# that of the release build (target recordings). Each set is the project's own (rtl/CMakeLists.txt) with one change. Takes some
# minutes; wants a machine that does nothing else. Exit status: 0 measured, 1 a build gave wrong pins, 2 wrong call.
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
recording=${1:-$root/build/release/tb/long.mvec}
if [[ $# -gt 1 || ! -f $recording ]]; then
  echo "verilator_speed.sh: $recording: no such recording; build target recordings, or name one" >&2
  exit 2
fi
recording=$(realpath "$recording")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mapfile -t base_files < <(ls "$root"/base/*.cpp | grep -v build_stamp)  # which only a build knows
mapfile -t files < <(sed -n "s,^\(.*tc_.*\.sv\)$,$root/rtl/\1,p" "$root/rtl/tc.f")

base=
# measure NAME "VERILATOR ARGUMENTS" OPT_FAST [VLT FILES]
measure() {
  local name=$1 args=$2 fast=$3 vlt=${4-$root/rtl/flops.vlt} dir speed
  dir=$work/$(tr -c 'a-z0-9\n' _ <<< "$name")
  # shellcheck disable=SC2086
  verilator --cc --exe --build -j 2 -Wno-lint -Wno-fatal --top-module tc_top --prefix Vtc_top --Mdir "$dir" -I"$root/rtl" --unroll-count 256 \
    --x-assign 0 --x-initial 0 $args -MAKEFLAGS "OPT_FAST=$fast OPT_SLOW=-O1 OPT_GLOBAL=-O2" -CFLAGS "-std=c++20 -I$root" \
    "$root/rtl/waivers.vlt" $vlt "${files[@]}" "$root/tests/rtl/verilator_speed.cpp" "$root/tb/pins/chip_pins.cpp" \
    "$root"/recording/*.cpp "${base_files[@]}" -LDFLAGS "-lfmt -lcrypto" -o speed > "$work/log" 2>&1 ||
    { grep -m1 -i error "$work/log" >&2; exit 1; }
  speed=$("$dir/speed" "$recording") || { echo "$name: $speed" >&2; exit 1; }
  base=${base:-$speed}
  printf '%-44s %6.3f Mclock/s  %5.2f\n' "$name" "$speed" "$(awk -v a="$speed" -v b="$base" 'BEGIN { print a / b }')"
}

measure "as the project builds it" "-O3 --assert" -O2
measure "g++ -O1" "-O3 --assert" -O1
measure "g++ -O3" "-O3 --assert" -O3
measure "g++ -Os" "-O3 --assert" -Os
measure "split into files of 5000 statements" "-O3 --assert --output-split 5000 --output-split-cfuncs 500" -O2
measure "without Verilator's dataflow optimiser" "-O3 --assert -fno-dfg" -O2
measure "without assertions" "-O3" -O2
measure "flops hidden (no lockstep possible)" "-O3 --assert" -O2 ""
measure "two threads" "-O3 --assert --threads 2" -O2
