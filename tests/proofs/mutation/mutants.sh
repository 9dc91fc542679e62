#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# mutants.sh N SEED [OPTIONS OF mutants]: N random mutants of the RTL, drawn by SEED, against the random lockstep runs, in a build
# folder of its own (build/mutants-N-SEED). Prints a line a mutant, tables by file and kind, the score.
# Exit status: 0 score at or above --wanted PERCENT, 1 below it, 2 wrong call or no build.
set -euo pipefail

refuse() {
  echo "mutants.sh: $*" >&2
  exit 2
}

is_number() { [[ $1 =~ ^[0-9]{1,9}$ ]]; }

[ $# -ge 2 ] || refuse "expected N SEED, found $# arguments; for example: mutants.sh 300 1 --wanted 85"
is_number "$1" && [ "$1" -gt 0 ] || refuse "N: expected a number of mutants from 1, found '$1'"
is_number "$2" || refuse "SEED: expected a number from 0, found '$2'"
count=$((10#$1)) seed=$((10#$2))
shift 2

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../../.." && pwd -P)
folder=$root/build/mutants-$count-$seed
mkdir -p "$folder"
[ ! -t 2 ] || echo "building $count mutants in ${folder#"$root"/} ..." >&2
if ! { (cd "$root" && cmake --preset release -B "$folder" -DMELTSTAGE_MUTANTS="$count" -DMELTSTAGE_MUTANT_SEED="$seed") &&
  cmake --build "$folder" --target mutants; } >"$folder/build.log" 2>&1; then
  tail -n 20 "$folder/build.log" >&2
  refuse "no build; all of it in ${folder#"$root"/}/build.log"
fi
exec "$folder/tests/proofs/mutation/mutants" "$@"
