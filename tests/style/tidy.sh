#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# tidy.sh BUILD FILE...: clang-tidy has nothing to say of the C++ files, compiled as in the build folder (.clang-tidy tells the checks). Exit status: 0
# nothing, 1 something, 2 wrong call.
set -euo pipefail
[[ $# -ge 2 && -f $1/compile_commands.json ]] || { echo "tidy.sh: expected a build folder and C++ files, found '$*'" >&2; exit 2; }
build=$1
shift
# Debian 12's clang-tidy does not know every warning of its GCC.
printf '%s\0' "$@" | xargs -0 -P "$(nproc)" -n 1 clang-tidy -p "$build" --quiet --extra-arg=-Wno-unknown-warning-option 2>/dev/null || {
  echo "tidy.sh: not tidy; .clang-tidy names the checks" >&2
  exit 1
}
echo "$# files, all tidy"
