#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# holes.sh REQUIREMENTS PLAN...: each change of the requirements must be refused by the command PLAN, with these words.
set -euo pipefail
requirements=$1
shift
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
while IFS=$'\t' read -r edit words; do
  sed "$edit" "$requirements" > "$work/requirements.toml"
  ! cmp -s "$requirements" "$work/requirements.toml" || { echo "holes.sh: $edit: changes nothing"; exit 1; }
  ! "$@" --requirements "$work/requirements.toml" 2> "$work/said" || { echo "holes.sh: $edit: not refused"; exit 1; }
  grep -qF "$words" "$work/said" || { echo "holes.sh: $edit: expected '$words', found"; cat "$work/said"; exit 1; }
done <<'EOT'
s/"GuardStale.\*"/"GuardStail.*"/	P4: found no tests GuardStail.*, expected one at least
s/"P08_\*"/"P07_*"/	property P08_LowBeforeEnd_A: found it in no requirement
s/^properties = \["P08_\*"\]//	P8: found neither properties nor points
s/, "late tick"\]/]/	point late tick: found it in no requirement
s/^id = "P2"/id = "P1"/	P1: found it twice
EOT
