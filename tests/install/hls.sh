#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# hls.sh BUILD: the installed command proves the installed example by the installed header alone.
set -euo pipefail
prefix=$(mktemp -d)
trap 'rm -rf "$prefix"' EXIT
cmake --install "$1" --component app --prefix "$prefix" >/dev/null
example=$prefix/share/meltstage/examples/hls
"$prefix/bin/meltstage-hls" hls prove "$example/debounce.cpp" --option="-I$prefix/include/meltstage" --rtl "$example/debounce.f" --top debounce
