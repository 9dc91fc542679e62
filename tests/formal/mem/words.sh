#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# words.sh [WORD...]: the proof of tc_mem for these words of the parameter memory, else for each; two at a time, a line each. Exit status 1 when one isn't proved.
set -euo pipefail
formal=$(cd "$(dirname "$0")/.." && pwd)
last=$(($(sed -n 's/.*HoldingCount = \([0-9]*\);.*/\1/p' "$formal/../../rtl/tc_pkg.sv") - 1))
for word in "$@"; do
  [[ $word =~ ^[0-9]+$ && $word -ge 1 && $word -le $last ]] || { echo "words.sh: found word $word, expected 1 to $last" >&2; exit 2; }
done
[[ $# -gt 0 ]] || set -- $(seq "$last")
printf '%s\n' "$@" | xargs -P 2 -I{} bash -c '
  told=$("$0" mem --set Word={} 2>&1) && echo "word {}: $(head -n 1 <<< "$told")" || { echo "word {}: $told"; exit 1; }' "$formal/prove.sh" || exit 1
