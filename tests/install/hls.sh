#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# hls.sh BUILD: the installed command proves the installed example by the installed header alone.
set -euo pipefail
prefix=$(mktemp -d)
trap 'rm -rf "$prefix"' EXIT
for part in meltstage meltstage-hls hls; do cmake --install "$1" --component $part --prefix "$prefix" >/dev/null; done
example=$prefix/share/meltstage/examples/hls
"$prefix/bin/meltstage" hls prove "$example/debounce.cpp" --option="-I$prefix/include/meltstage" --rtl "$example/debounce.f" --top debounce
