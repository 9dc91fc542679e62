#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# unpacked.sh FOLDER: commands of the packages run from where these put them, those of other programs, too.
set -euo pipefail
root=$(mktemp -d)
trap 'rm -rf "$root"' EXIT
for deb in "$1"/*.deb; do dpkg-deb -x "$deb" "$root"; done
cd "$root"
usr/bin/meltstage print usr/share/meltstage/examples/first.toml --rtl none
[[ -s out/first/report.html ]]
usr/bin/meltstage page --out chip.html
usr/bin/meltstage regress list >/dev/null
usr/bin/meltstage dft --help >/dev/null
PYTHONPATH=usr/lib/python3/dist-packages /usr/bin/python3 -B -c 'import meltstage; chip = meltstage.Chip(); chip.step(100)'
[[ -s usr/lib/cmake/meltstage/meltstage-config.cmake && -s usr/share/meltstage/rtl/tc.f ]]
