#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# unknown_part.sh PREFIX FOLDER: a part that isn't known, and one that isn't installed, are named with the reason.
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
