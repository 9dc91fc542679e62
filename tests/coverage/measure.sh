#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# tests/coverage/measure.sh [FOLDER]: which lines the tests of ./check run, in a build of its own (build/coverage); an hour or two.
# Prints a table of lines a room of C++ (gcov) and of lines and branches a file of RTL (Verilator, suite pr of meltstage regress).
# What no test has run is listed in FOLDER (default out/coverage): cpp.txt, rtl.txt. Exit status: 0 when each room has
# at least 95 % and each file of RTL all, 1 when not.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd -P)
source "$root/cmake/setup.sh"
here=$root/tests/coverage
build=$root/build/coverage
out=$(mkdir -p "${1:-$root/out/coverage}" && cd "${1:-$root/out/coverage}" && pwd -P)

install_packages run vision silicon hls live page python packages docs peers check coverage
configure coverage "${all_parts[@]}"
# counts of earlier tests go; the recordings are made anew, as making them is what runs their program
find "$build" -name '*.gcda' -delete
rm -f "$build"/tb/*.mvec
build coverage all

echo "== tests"
# those of other rooms are left out, and suite pr, which comes next; a test that is too slow with counters has run its lines all the same
others='^(hls|docs|style|install|changes|kernel|fuzz|bench|proof|formal|coverage)[._]|^(Regress\.pr|Generated|Canary|Mutants|Netlist|Fpga|Copied|Page)'
ctest --test-dir "$build" --label-exclude '^long$' --exclude-regex "$others" --timeout 3000 -j "$(nproc)" --output-log "$out/tests.log" >/dev/null || true
grep -E 'tests passed|\(Failed\)|\(Timeout\)' "$out/tests.log" || true

echo "== suite pr"
rm -rf "$out/rtl"
mkdir "$out/rtl"
RTL_COVERAGE=$out/rtl "$build/app/meltstage-regress" regress run pr --out "$out/regress" --fresh >"$out/regress.log"
verilator_coverage --write "$out/rtl.dat" "$out"/rtl/*.dat >/dev/null

echo "== lines"
(cd "$build" && gcovr --root "$root" --object-directory "$build" --gcov-ignore-parse-errors --exclude-unreachable-branches \
  --filter "$root/(cmodel|motion|asic|tb)/" --json "$out/cpp.json" "$build" 2>"$out/gcovr.log")
python3 -B "$here/tables.py" "$out"
