#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# headers_alone.sh PREFIX: each installed header compiles by itself, with what is installed alone.
set -euo pipefail
include=$1/include
cd "$include"
# shellcheck disable=SC2046
find meltstage -name '*.hpp' -print0 | sort -z |
  xargs -0 -P 2 -I HEADER g++ -std=c++20 -fsyntax-only -I . -I meltstage $(pkg-config --cflags eigen3) -include HEADER -x c++ /dev/null
