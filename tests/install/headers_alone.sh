#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# headers_alone.sh PREFIX [COUNT]: each installed header, or so many drawn at random, compiles by itself, with what is installed alone.
set -euo pipefail
include=$1/include count=${2:-1000000}
cd "$include"
# shellcheck disable=SC2046
find meltstage -name '*.hpp' -print0 | shuf -z -n "$count" |
  xargs -0 -P 2 -I HEADER g++ -std=c++20 -fsyntax-only -I . -I meltstage $(pkg-config --cflags eigen3) -include HEADER -x c++ /dev/null
