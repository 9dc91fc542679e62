#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# sound.sh FOLDER: lintian finds no error in the packages, and finds one in a package that has lost its copyright.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
lintian --allow-root --fail-on error "$1"/*.deb
dpkg-deb -R "$1"/meltstage-rtl_*.deb "$work/broken"
rm "$work/broken/usr/share/doc/meltstage-rtl/copyright"
dpkg-deb --root-owner-group -b "$work/broken" "$work/broken.deb" >/dev/null
! lintian --allow-root --fail-on error "$work/broken.deb" >"$work/found" || { echo "lintian let a package without copyright pass" >&2; exit 1; }
grep -q no-copyright-file "$work/found"
