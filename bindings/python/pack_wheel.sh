#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# pack_wheel.sh FOLDER INFO VERSION MODULE SOURCES...: FOLDER/meltstage as a wheel in FOLDER. INFO holds its METADATA and WHEEL. Only the
# files that are named go in, as Python leaves others in the package's folder when it runs.
set -euo pipefail
folder=$1 info=$2 version=$3
tree=$(mktemp -d)
trap 'rm -rf "$tree"' EXIT
mkdir "$tree/meltstage" "$tree/meltstage-$version.dist-info"
cd "$folder"
cp "meltstage/$4" "${@:5}" "$tree/meltstage/"
cp "$info/METADATA" "$info/WHEEL" "$tree/meltstage-$version.dist-info/"
/usr/bin/python3 -m wheel pack --dest-dir "$folder" "$tree" >/dev/null
