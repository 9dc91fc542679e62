#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# types.sh FOLDER: the package in FOLDER is typed throughout, and what its stub says of the C++ side is so.
set -euo pipefail
cache=$(mktemp -d)
trap 'rm -rf "$cache"' EXIT
export MYPYPATH=$1 PYTHONPATH=$1
cd "$cache"
/usr/bin/mypy --strict --cache-dir "$cache" -p meltstage
# not in a stub: the metaclass of pybind11, and its __init__ of classes that only C++ makes
printf '%s\n' 'meltstage\._core\.(AxesMotion|Chip|Profile|Recording|Run)' 'meltstage\._core\.(AxesMotion|Profile)\.__init__' >allowed
/usr/bin/stubtest --allowlist allowed meltstage._core
