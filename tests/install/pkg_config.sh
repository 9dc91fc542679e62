#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# pkg_config.sh PREFIX FOLDER: the same without CMake.
set -euo pipefail
export PKG_CONFIG_PATH=$1/lib/pkgconfig
for part in model recording host motion_profile; do pkg-config --print-errors --exists "meltstage-$part"; done
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
# shellcheck disable=SC2046
g++ -O1 "$2/step_chip.cpp" -o "$work/step_chip" $(pkg-config --cflags --libs --static meltstage-model meltstage-recording meltstage-host)
"$work/step_chip"
