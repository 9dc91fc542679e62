#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# install.sh BUILD PREFIX PART...: installs these parts into PREFIX, made anew; private headers stay at home.
set -euo pipefail
build=$1 prefix=$2
rm -rf "$prefix"
for part in "${@:3}"; do cmake --install "$build" --component "$part" --prefix "$prefix" >/dev/null; done
for private in motion/profile/profile_parts.hpp motion/bumps/coordinate_sources.hpp motion/tour/lattice.hpp recording/text_format.hpp; do
  [[ ! -e $prefix/include/meltstage/$private ]] || { echo "installed, and should be private: $private" >&2; exit 1; }
done
