#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# manual_pages.sh FOLDER: groff formats each page without a warning, and a page shows what its command takes.
set -euo pipefail
pages=("$1"/*.1.gz)
for page in "${pages[@]}"; do
  told=$(zcat "$page" | groff -man -Tutf8 -ww -rLL=100n 2>&1 >/dev/null)
  [[ -z $told ]] || { echo "$page: $told" >&2; exit 1; }
done
zcat "$1/meltstage-print.1.gz" | groff -man -Tascii -P-cbou -rLL=100n | grep -q -- '--rtl chosen|full|none' || { echo "meltstage-print.1 lacks --rtl" >&2; exit 1; }
echo "${#pages[@]} pages"
