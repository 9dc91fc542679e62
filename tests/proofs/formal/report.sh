#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Proves all blocks, with their seeded bugs, and writes what was found into docs/verify/properties.md.
#   report.sh [TABLE]   TABLE: a file to keep what prove.sh found; lines that are there already are kept (other blocks of an earlier run)
#   report.sh TABLE BLOCK...   only these blocks anew
# Exit status: 0 all as it should be, 1 a proof failed (the page is written all the same), 2 wrong call.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
table=${1:-$(mktemp)}
shift || true
status=0
touch "$table"
for block in "${@:-$(cd "$here" && ls -d -- */ | tr -d /)}"; do
  for one in $block; do
    sed -i "\,^\(proof\|cover\|bug\)\t$one[/\t],d" "$table"
    "$here/prove.sh" "$one" --table "$table" || status=1
    [[ ! -e $here/$one/bugs.txt ]] || "$here/prove.sh" "$one" --bugs --table "$table" || status=1
  done
done
/usr/bin/python3 -B "$here/report.py" "$table"
exit $status
