#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# pkg_config.sh PREFIX FOLDER: the same without CMake.
set -euo pipefail
export PKG_CONFIG_PATH=$1/lib/pkgconfig
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# builds PROGRAM FOLDER PART...
builds() {
  # shellcheck disable=SC2046
  g++ -O1 "$2/$1.cpp" -o "$work/$1" $(pkg-config --print-errors --cflags --libs --static "${@:3}")
  "$work/$1"
}
builds step_chip "$2" meltstage-model meltstage-recording meltstage-host
builds one_profile "$2" meltstage-motion_profile
