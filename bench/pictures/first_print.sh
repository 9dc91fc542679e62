#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Takes the README's picture: the upper part of the page that a print wrote, as a browser shows it.
#   first_print.sh out/first/report.html docs/pictures/first_print.png        (needs chromium)
set -euo pipefail
if [[ $# != 2 || ! -r ${1:-} ]]; then
  echo "first_print.sh: found '$*', expected REPORT.html, as ./run writes it, and PICTURE.png" >&2
  exit 2
fi
if ! command -v chromium > /dev/null; then
  echo "first_print.sh: chromium is missing; as root: apt-get install chromium" >&2
  exit 2
fi
profile=$(mktemp -d)
trap 'rm -rf "$profile"' EXIT
# the height ends below the path
chromium --headless --no-sandbox --disable-gpu --hide-scrollbars --user-data-dir="$profile" --window-size=1100,1430 \
  --virtual-time-budget=4000 --screenshot="$profile/picture.png" "file://$(realpath "$1")" > "$profile/log" 2>&1 ||
  { tail -n 3 "$profile/log" >&2; exit 1; }
cp "$profile/picture.png" "$2"
