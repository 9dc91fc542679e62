#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Proofs of one block, for all inputs and all time: Yosys writes an AIGER, ABC's PDR proves it; or, where
# tests/formal/BLOCK/engine says "induction", Yosys proves it by k-induction.
#   prove.sh BLOCK           every harness tests/formal/BLOCK/*.sv: all assertions hold, every cover can be reached
#   prove.sh BLOCK --bugs    every line of tests/formal/BLOCK/bugs.txt (file, tab, sed expression, tab, what it breaks) changes a copy
#                            of the RTL so that the proof must fail
# tests/formal/BLOCK/HARNESS.map, if there, is a techmap that cuts out cells (over-approximation); tests/formal/BLOCK/flags holds
# Yosys read options. Exit status: 0 all as it should be, 1 not, 2 wrong call.
set -euo pipefail

here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
block=${1:-}
mode=${2:-}
if [[ -z $block || ! -d $here/$block || ( -n $mode && $mode != --bugs ) ]]; then
  echo "prove.sh: expected BLOCK [--bugs] with BLOCK one of $(cd "$here" && ls -d -- */ | tr -d / | xargs), found '$*'" >&2
  exit 2
fi
seconds=300   # for one proof
flags=$(cat "$here/$block/flags" 2>/dev/null || true)
engine=$(cat "$here/$block/engine" 2>/dev/null || echo pdr)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# write_aiger HARNESS RTL_FOLDER WHAT: assert.aig and, where WHAT is "and covers", cover.aig, an output a property, named in
# assert.names and cover.names. A cover is reached when the assertion of its contrary fails.
echo 'module \$cover (input A, input EN); \$assert never (.A(!A), .EN(EN)); endmodule' > "$work/cover_map.v"
write_aiger() {
  local harness=$1 rtl=$2 cut=${1%.sv}.map top files finish covers=
  top=$(sed -n 's/^module \([A-Za-z0-9_]*\).*/\1/p' "$harness" | head -1)
  files=$(sed "s,^,$rtl/," "$root/rtl/tc.f" | xargs)
  [[ -f $cut ]] && cut="techmap -map $cut" || cut=
  finish="opt -fast -nodffe -nosdff; dffunmap; techmap; opt -fast -nodffe -nosdff; dffunmap; abc -g AND; opt_clean"
  [[ ${3:-} != "and covers" ]] || covers="design -load read
    chformal -assert -remove; techmap -map $work/cover_map.v; $finish; write_aiger -zinit $work/cover.aig; tee -o $work/cover.names select -list t:\$assert"
  yosys -q -p "read_verilog -sv -formal -defer -I $rtl $flags $files $harness
    hierarchy -check -top $top; proc; memory_map; flatten; $cut; opt -fast; async2sync; opt_clean; chformal -early; design -save read
    chformal -cover -remove; write_ilang $work/asserts.il; $finish; write_aiger -zinit $work/assert.aig; tee -o $work/assert.names select -list t:\$assert
    $covers" \
    > "$work/yosys.log" 2>&1 || { echo "prove.sh: $harness: $(grep -m1 ERROR "$work/yosys.log")" >&2; exit 1; }
}
# All assertions as one property, so that each may lean on the others. The words of the tools count, not their exit status.
prove() {
  if [[ $engine == induction ]]; then
    yosys -p "read_ilang $work/asserts.il; opt -fast -nodffe -nosdff; dffunmap; opt_clean
              sat -tempinduct -maxsteps 4 -prove-asserts -timeout $seconds" > "$work/abc.log" 2>&1 || true
    grep -q 'Induction step proven: SUCCESS' "$work/abc.log" && return
    berkeley-abc -c "read_aiger $work/assert.aig; fold; strash; orpos; bmc3 -F 40 -T $seconds" > "$work/abc.log" 2>&1 || true
    return 1
  fi
  berkeley-abc -c "read_aiger $work/assert.aig; fold; strash; orpos; scorr; pdr -T $seconds" > "$work/abc.log" 2>&1 || true
  grep -q 'Property proved' "$work/abc.log"
}
# A counterexample alone, for a seeded bug: where induction proves, bounded search is what refutes.
refute() {
  if [[ $engine == induction ]]; then
    berkeley-abc -c "read_aiger $work/assert.aig; fold; strash; orpos; bmc3 -F 40 -T $seconds" > "$work/abc.log" 2>&1 || true
  else
    prove || true
  fi
}
refuted() { grep -aq 'asserted in frame' "$work/abc.log"; }

# Name of an assertion that does not hold, and in which clock; else ABC's last words.
failed() {
  local words output
  refuted || { tail -n 1 "$work/abc.log"; return; }
  berkeley-abc -c "read_aiger $work/assert.aig; fold; strash; bmc3 -T $seconds" > "$work/bmc.log" 2>&1 || true
  words=$(grep -a -m1 'asserted in frame' "$work/bmc.log") || { echo "refuted"; return; }
  output=$(sed 's/Output *\([0-9]*\).*/\1/' <<< "$words")
  echo "$(sed -n "$((output + 1))p" "$work/assert.names" | sed 's,.*/,,') in clock $(sed 's/.*frame *\([0-9]*\).*/\1/' <<< "$words")"
}

status=0
say() { echo "$1"; [[ $1 != FAIL* ]] || status=1; }

prove_harness() {
  local name=$1 n reached unreached
  n=$(wc -l < "$work/assert.names")
  if prove; then
    say "ok    $name: $n assertions proved"
  else
    say "FAIL  $name: $(failed)"
  fi
  n=$(wc -l < "$work/cover.names")
  berkeley-abc -c "read_aiger $work/cover.aig; fold; strash; pdr -a -T $seconds" > "$work/cover.log" 2>&1 || true
  reached=" $(grep -ao 'Output *[0-9]* was asserted' "$work/cover.log" | grep -o '[0-9]*' | xargs || true) "
  unreached=$(awk -v reached="$reached" 'index(reached, " " NR - 1 " ") == 0 { sub(/.*\//, ""); sub(/\.never$/, ""); print }' "$work/cover.names")
  if [[ -z $unreached ]]; then say "ok    $name: $n covers reached"; else say "FAIL  $name: never reached: $(xargs <<< "$unreached")"; fi
}

# Every seeded bug must give a counterexample in some harness of the block.
prove_bugs() {
  local file change what found harness
  while IFS=$'\t' read -r file change what; do
    [[ -n $file && $file != '#'* ]] || continue
    rm -rf "$work/rtl" && cp -r "$root/rtl" "$work/rtl"
    sed -i "$change" "$work/rtl/$file"
    if cmp -s "$root/rtl/$file" "$work/rtl/$file"; then
      say "FAIL  $block: '$what': the change no longer applies to rtl/$file"
      continue
    fi
    found=
    for harness in "$here/$block"/*.sv; do
      write_aiger "$harness" "$work/rtl"
      refute
      if refuted; then found=yes; break; fi
    done
    if [[ -n $found ]]; then say "ok    $block: refused: $what ($(failed))"; else say "FAIL  $block: proof does not see: $what"; fi
  done < "$here/$block/bugs.txt"
}

if [[ $mode == --bugs ]]; then
  prove_bugs
else
  for harness in "$here/$block"/*.sv; do
    write_aiger "$harness" "$root/rtl" "and covers"
    prove_harness "$block/$(basename "$harness" .sv)"
  done
fi
exit $status
