#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# mutants.sh [OPTIONS]: builds the RTL with all its mutants and judges them; the options are those of the program `mutants` (--help).
# Exit status: its own, or 2 without a build.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../../.." && pwd -P)
source "$root/cmake/setup.sh"
{
  install_packages run vision silicon hls live page python packages docs peers check
  configure release "${all_parts[@]}"
  build release mutants || exit 2
} >&2
exec "$root/build/release/tests/proofs/mutation/mutants" "$@"
