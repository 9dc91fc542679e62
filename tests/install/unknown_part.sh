#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# unknown_part.sh PREFIX FOLDER: a part that isn't known, and one that isn't installed, are named with the reason. One that is wanted if
# it is there isn't there when a part that it needs is not installed; the others are found all the same.
set -euo pipefail
prefix=$1 folder=$2
rm -rf "$folder"
mkdir -p "$folder"
fail() { echo "unknown_part.sh: $*" >&2; exit 1; }

# says PREFIX PART WORDS
says() {
  printf 'cmake_minimum_required(VERSION 3.25)\nproject(p LANGUAGES CXX)\nfind_package(meltstage 0.1 REQUIRED COMPONENTS %s)\n' "$2" > "$folder/CMakeLists.txt"
  ! cmake -S "$folder" -B "$folder/build" --fresh -DCMAKE_PREFIX_PATH="$1" > "$folder/said" 2>&1 || fail "part $2 is taken"
  tr -s ' \n' ' ' < "$folder/said" | grep -q "$3" || fail "part $2: $(cat "$folder/said")"
}
says "$prefix" motoin 'found no part "motoin", expected one of files, base, '
cp -r "$prefix" "$folder/less"
rm "$folder"/less/lib*/cmake/meltstage/meltstage-files*.cmake "$folder"/less/lib/*/cmake/meltstage/meltstage-files*.cmake 2> /dev/null || true
says "$folder/less" recording 'part "files" is not installed'

# finds PREFIX PARTS FOUND [OPTION]: whether the package is found, and which of these optional parts are.
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
finds() {
  cmake -S "$here/optional" -B "$folder/build" --fresh -DCMAKE_PREFIX_PATH="$1" -DOPTIONAL="$2" "${@:4}" > "$folder/said" 2>&1 || fail "optional $2: $(cat "$folder/said")"
  grep -qx -- "-- found $3" "$folder/said" || fail "optional $2, expected $3: $(cat "$folder/said")"
}
remove() { find "$1" -name "meltstage-$2*.cmake" -delete; }
finds "$prefix" 'recording;motion_tour;host' '1 recording motion_tour host'
finds "$prefix" 'recording;motoin' '1 recording'
finds "$prefix" 'recording;motion_tour' '1 recording' -DCMAKE_DISABLE_FIND_PACKAGE_Eigen3=ON  # nor without a package
cp -r "$prefix" "$folder/no_bumps"
remove "$folder/no_bumps" motion_bumps
finds "$folder/no_bumps" 'recording;motion_tour;motion_profile' '1 recording motion_profile'
says "$folder/no_bumps" motion_tour 'part "motion_bumps" is not installed'
