#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# symbols.sh LIBRARY HEADER PROGRAM: the library's dynamic symbols are the functions of its header, under the header's version, and nothing
# else. PROGRAM, in C, calls each of them.
set -euo pipefail
declared=$(grep -oE '\bms_[a-z_]+\(' "$2" | grep -v '\.\.\.' | tr -d '(' | sort -u)
version=$(grep -oE 'version (MELTSTAGE_[0-9.]*[0-9])' "$2" | head -n1 | cut -d' ' -f2)
exported=$(nm -D --defined-only --with-symbol-versions "$1" | awk '$2 != "A" { print $3 }' | sort)
diff <(sed "s/\$/@@$version/" <<<"$declared") <(echo "$exported") || { echo "symbols: found the right ones, expected those on the left" >&2; exit 1; }
while read -r name; do
  grep -q "\b$name(" "$3" || { echo "$3: found no call of $name, expected one" >&2; exit 1; }
done <<<"$declared"
