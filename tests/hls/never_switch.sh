#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# never_switch.sh LIST COMMAND...: whether the bits that the command proves never to switch are those of the list.
set -euo pipefail
list=$1
shift
found=$("$@")
tail -n1 <<<"$found"
diff <(sort "$list") <(grep ' never ' <<<"$found" | grep -v ' bits of flops: ' | sed 's/, where the invariants hold//' | sort)
