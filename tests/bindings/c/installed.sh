#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# installed.sh BUILD PROGRAM: a C program is built by pkg-config against the installed library alone, and runs.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cmake --install "$1" --component c --prefix "$folder/prefix" >/dev/null
export PKG_CONFIG_PATH=$folder/prefix/lib/pkgconfig
read -ra flags <<<"$(pkg-config --cflags --libs meltstage)"
gcc -std=c11 -Wall -Wextra -Werror -pedantic "$2" "${flags[@]}" -lm -o "$folder/program"
LD_LIBRARY_PATH=$(pkg-config --variable=libdir meltstage) "$folder/program" "$folder"
