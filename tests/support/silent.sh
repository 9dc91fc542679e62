#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# silent.sh COMMAND...: passes when the command succeeds and prints nothing.
output=$("$@" 2>&1) || { printf '%s\n' "$output"; exit 1; }
[ -z "$output" ] || { printf '%s\n' "$output"; exit 1; }
