#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# wrong_use.sh SDF_REPLAY: passes when wrong use is one line and exit status 2.
set -uo pipefail
tool=$1
here=$0
refused() {
  told=$("$tool" "${@:2}" 2>&1)
  [ $? = 2 ] && [ "$(wc -l <<<"$told")" = 1 ] && grep -q -- "$1" <<<"$told" || { echo "expected: $1; found: $told"; exit 1; }
}
refused "expected REFERENCE.il"
refused "expected REFERENCE.il" "$here" "$here"
refused "PERIOD_NS: found ten" "$here" "$here" "$here" top "$here" ten
refused "PERIOD_NS: found 0," "$here" "$here" "$here" top "$here" 0
refused "found a=2, expected PORT=0" "$here" "$here" "$here" top "$here" 10 a=2
refused "--reset: found rst, expected PORT=0" "$here" "$here" "$here" top "$here" 10 --reset rst
refused "expected REFERENCE.il" "$here" "$here" "$here" top "$here" 10 --rest x=0
refused "nosuch.il: not there" nosuch.il "$here" "$here" top "$here" 10
refused "yosys failed" "$here" "$here" "$here" top "$here" 10
