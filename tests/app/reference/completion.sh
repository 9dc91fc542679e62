#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# completion.sh FILE: bash completes verbs, commands, options and choices, and leaves files to itself.
set -euo pipefail
source "$1"

# completes LINE EXPECTED...: behind LINE stand these words, in any order.
completes() {
  local found
  read -ra COMP_WORDS <<<"$1"
  [[ $1 != *" " ]] || COMP_WORDS+=("")
  COMP_CWORD=$((${#COMP_WORDS[@]} - 1))
  COMPREPLY=()
  _meltstage
  found=$(printf '%s\n' "${COMPREPLY[@]}" | sort | tr '\n' ' ')
  expected=$(printf '%s\n' "${@:2}" | sort | tr '\n' ' ')
  [[ $found == "$expected" ]] || { echo "'$1': found $found, expected $expected" >&2; exit 1; }
}

completes "meltstage pri" print
completes "meltstage window" window windows
completes "meltstage dft gr" grade
completes "meltstage print --rtl " chosen full none
completes "meltstage print --rtl f" full
completes "meltstage print --vcd --ou" --out
completes "meltstage print --out " ""
completes "meltstage chip set --p" --port
