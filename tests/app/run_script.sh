#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# run_script.sh ROOT: what ./run says while it makes a command ready goes to standard error, so that the command's own answer can be piped
# on, and its exit status is the command's. The set-up and the command are stand-ins.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
mkdir -p "$folder/cmake" "$folder/build/release/app"
cp "$1/run" "$folder/run"
for step in install_packages configure build; do echo "$step() { echo \"chatter of $step\"; }"; done > "$folder/cmake/setup.sh"
printf '#!/bin/bash\necho "answer to $*"\nexit 3\n' > "$folder/build/release/app/meltstage"
chmod +x "$folder/build/release/app/meltstage"
for verb in print bench "bench vectors" "bench proof" hls; do
  status=0
  answer=$("$folder/run" $verb --json 2> "$folder/told") || status=$?
  [[ $answer == "answer to $verb --json" && $status == 3 ]] ||
    { echo "FAILED: ./run $verb: found '$answer' and status $status, expected the command's own answer and 3" >&2; exit 1; }
  grep -q 'chatter of build' "$folder/told" || { echo "FAILED: ./run $verb: nothing was built" >&2; exit 1; }
done
for verb in datasheet site; do
  answer=$("$folder/run" $verb 2> "$folder/told")
  [[ $answer == "$folder"/build/release/$verb/*.* ]] || { echo "FAILED: ./run $verb: found '$answer', expected the place of what was built" >&2; exit 1; }
  grep -q 'chatter of build' "$folder/told" || { echo "FAILED: ./run $verb: nothing was built" >&2; exit 1; }
done
