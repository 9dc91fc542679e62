#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# format.sh ROOT: every C++ file of the project is as clang-format (.clang-format) writes it. Exit status: 0 all are, 1 one is not, 2 wrong call.
set -euo pipefail
[[ $# == 1 && -f $1/.clang-format ]] || { echo "format.sh: expected the project's folder, found '$*'" >&2; exit 2; }
cd "$1"
mapfile -d '' files < <(find . \( -path ./build -o -path ./out -o -path './.*' \) -prune -o \( -name '*.cpp' -o -name '*.hpp' \) -print0)
bad=0
for file in "${files[@]}"; do echo "$file"; done | xargs -P "$(nproc)" -n 40 clang-format --dry-run -Werror 2> >(grep 'error:' >&2) || bad=1
[[ $bad == 0 ]] || { echo "format.sh: not formatted; run: clang-format -i FILE" >&2; exit 1; }
echo "${#files[@]} files, all formatted"
