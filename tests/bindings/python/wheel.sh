#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# wheel.sh FOLDER: pip installs the wheel of FOLDER into an empty prefix, where the package works without the build, and has all its files.
set -euo pipefail
folder=$1
prefix=$(mktemp -d)
trap 'rm -rf "$prefix"' EXIT
/usr/bin/python3 -m pip install --quiet --no-index --no-deps --no-cache-dir --root-user-action=ignore --target "$prefix" "$folder"/meltstage-*.whl
cd "$prefix"
env -u PYTHONPATH /usr/bin/python3 -B - "$prefix" <<'PROGRAM'
import sys, importlib.metadata
sys.path.insert(0, sys.argv[1])
import meltstage
assert meltstage.__file__.startswith(sys.argv[1]), meltstage.__file__
assert importlib.metadata.version("meltstage") == meltstage.__version__
chip = meltstage.Chip()
chip.step(100)
assert chip.cycle == 100 and meltstage.play("1 set SETPOINT 90", 2).failed == 0
PROGRAM
diff <(cd "$folder/meltstage" && find . -type f ! -name '*.pyc' | sort) <(cd "$prefix/meltstage" && find . -type f ! -name '*.pyc' | sort)
