#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# first_print.sh FOLDER: what a newcomer waits for. Makes a bare Debian 12 in FOLDER (debootstrap; root needed), copies the commit that is
# checked out into it, runs ./run there, and prints packages, megabytes, build steps, and the times of the build and of the print.
# FOLDER must not exist; it is left for a look. Exit status: 0 all as wanted, 1 a figure falls short, 2 wrong use.
set -euo pipefail
[[ $# == 1 && ! -e $1 ]] || { echo "first_print.sh: expected a folder that doesn't exist yet, found '$*'" >&2; exit 2; }
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P)
bare=$1
source "$root/bench/bare_debian.sh"
make_bare_debian
mkdir -p "$bare/meltstage"
git -C "$root" archive HEAD | tar -x -C "$bare/meltstage"
packages >"$bare.before"
in_it apt-get -q update >/dev/null
mapfile -t tier < <(root=$root && source "$root/cmake/setup.sh" && packages_of run)
megabytes=$(in_it apt-get install --no-install-recommends --print-uris -qq "${tier[@]}" | awk '{ sum += $3 } END { printf "%.0f", sum / 1e6 }')
clock_before=$(date +%s)
in_it /bin/bash -c 'root=/meltstage; source /meltstage/cmake/setup.sh; install_packages run' >&2
clock_installed=$(date +%s)
packages >"$bare.after"
TIMEFORMAT='%R %U %S'
{ time in_it /bin/bash -c 'cd /meltstage && ./run --build meltstage' >"$bare.build" 2>&1; } 2>"$bare.built" || { tail "$bare.build" >&2; exit 1; }
{ time in_it /bin/bash -c 'cd /meltstage && ./run' >&2; } 2>"$bare.printed"
steps=$(sed -n 's/^\[[0-9]*\/\([0-9]*\)\].*/\1/p' "$bare.build" | tail -n 1)

row "packages installed" "$(comm -13 "$bare.before" "$bare.after" | wc -l)" "" 220
row "download" "$megabytes" MB 200
row "time to install them" "$((clock_installed - clock_before))" s
row "build steps" "$steps" "" 100
row "build, processor time" "$(awk 'END { printf "%.1f", ($2 + $3) / 60 }' "$bare.built")" min 6
row "build, by the clock" "$(awk 'END { printf "%.1f", $1 / 60 }' "$bare.built")" min
row "first print, by the clock" "$(awk 'END { printf "%.1f", $1 }' "$bare.printed")" s
exit $status
