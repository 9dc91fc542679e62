#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Proofs of one block, for all inputs and all time (Yosys writes an AIGER, ABC's PDR proves it).
#   prove.sh BLOCK           every harness tests/formal/BLOCK/*.sv: all assertions hold, every cover can be reached
#   prove.sh BLOCK --bugs    every line of tests/formal/BLOCK/bugs.txt, a change of the RTL that the proof must refuse
# tests/formal/BLOCK/flags, if there, holds Yosys read options. Covers are looked for within 40 clocks of reset.
# Exit status 0 when all is as it should be.
set -euo pipefail

here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
block=${1:?usage: prove.sh BLOCK [--bugs]}
mode=${2:-}
[[ -d $here/$block ]] || { echo "prove.sh: no folder tests/formal/$block; blocks: $(cd "$here" && ls -d */ | tr -d /| xargs)" >&2; exit 2; }
flags=$(cat "$here/$block/flags" 2>/dev/null || true)
cover_clocks=40
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
bugs=$here/$block/bugs.txt

# write_aiger HARNESS RTL_FOLDER: $work/assert.aig and $work/cover.aig, with the properties' names as symbols.
write_aiger() {
  local harness=$1 rtl=$2 top files common finish
  top=$(sed -n 's/^module \([A-Za-z0-9_]*\).*/\1/p' "$harness" | head -1)
  files=$(sed "s,^,$rtl/," "$root/rtl/tc.f" | xargs)
  common="read_verilog -sv -formal -defer -I $rtl $flags $files $harness; hierarchy -check -top $top; proc; flatten; opt -fast; async2sync"
  finish="opt -fast -nodffe -nosdff; dffunmap; techmap; opt -fast -nodffe -nosdff; dffunmap; abc -g AND; opt_clean"
  # A cover is reached when the assertion of its contrary fails.
  echo 'module \$cover (input A, input EN); \$assert never (.A(!A), .EN(EN)); endmodule' > "$work/cover_map.v"
  yosys -q -p "$common; design -save read
    chformal -cover -remove; $finish; write_aiger -zinit -symbols $work/assert.aig
    design -load read
    chformal -assert -remove; techmap -map $work/cover_map.v; $finish; write_aiger -zinit -symbols $work/cover.aig" \
    > "$work/yosys.log" 2>&1 || { tail -5 "$work/yosys.log" >&2; exit 1; }
}

# ABC's own exit status says nothing about the proof.
proved() { berkeley-abc -c "read_aiger $work/assert.aig; fold; strash; scorr; pdr" > "$work/abc.log" 2>&1; grep -q 'Property proved' "$work/abc.log"; }
symbols() { grep -a '^b[0-9]' "$1" || true; }

status=0
for harness in "$here/$block"/*.sv; do
  name=$block/$(basename "$harness" .sv)
  if [[ $mode != --bugs ]]; then
    write_aiger "$harness" "$root/rtl"
    total=$(symbols "$work/assert.aig" | wc -l)
    if proved; then
      echo "$name: $total assertions proved"
    else
      echo "$name: NOT proved: $(grep -a -m1 'Output' "$work/abc.log" || tail -1 "$work/abc.log")"
      symbols "$work/assert.aig"
      status=1
    fi
    total=$(symbols "$work/cover.aig" | wc -l)
    berkeley-abc -c "read_aiger $work/cover.aig; fold; strash; bmc3 -a -F $cover_clocks" > "$work/cover.log" 2>&1 || true
    cat "$work/cover.log" | tail -3
  fi
done
exit $status
