#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# tidy.sh BUILD FILE...: clang-tidy has nothing to say of the C++ files, compiled as in the build folder (.clang-tidy tells the checks). Exit status: 0
# nothing, 1 something, 2 wrong call.
set -euo pipefail
[[ $# -ge 2 && -f $1/compile_commands.json ]] || { echo "tidy.sh: expected a build folder and C++ files, found '$*'" >&2; exit 2; }
build=$1
shift
# A release compiles a room as one file that includes those of the room: each of these is compiled as that is.
database=$(mktemp -d)
trap 'rm -r "$database"' EXIT
/usr/bin/python3 - "$build/compile_commands.json" >"$database/compile_commands.json" <<'EOF_OF_PYTHON'
import json, pathlib, re, sys

def units(entry):
    file = pathlib.Path(entry["file"])
    parts = re.findall(r'^#include "(/.*\.cpp)"$', file.read_text(), re.M) if "/Unity/" in str(file) and file.exists() else []
    return [entry | {"file": part, "command": entry["command"].replace(str(file), part)} for part in parts] or [entry]

json.dump([unit for entry in json.load(open(sys.argv[1])) for unit in units(entry)], sys.stdout)
EOF_OF_PYTHON
# Debian 12's clang-tidy does not know every warning of its GCC.
printf '%s\0' "$@" | xargs -0 -P "$(nproc)" -n 1 clang-tidy -p "$database" --quiet --extra-arg=-Wno-unknown-warning-option 2>/dev/null || {
  echo "tidy.sh: not tidy; .clang-tidy names the checks" >&2
  exit 1
}
echo "$# files, all tidy"
