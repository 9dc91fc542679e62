#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Proofs of one block, for all inputs and all time: Yosys writes an AIGER, ABC's PDR proves it; or, where the
# harness says so, Yosys proves it by k-induction.
#   prove.sh BLOCK           every harness tests/proofs/formal/BLOCK/*.sv: all assertions hold, every cover can be reached; BLOCK/HARNESS: that one
#   prove.sh BLOCK --bugs    every line of tests/proofs/formal/BLOCK/bugs.txt changes a copy of the RTL so that the proof must fail: file, tab,
#                            sed expression, tab, what it breaks, and, after another tab, the assertion that it must refute (else any); NAME! where the
#                            counterexample is too long to be found: the proof of NAME's harness must fail
#   prove.sh BLOCK --assertions       the assertions alone: the quick part, without the search for the covers
#   prove.sh BLOCK --bugs --draw N [--seed S]   only N of the bugs, drawn at random; the seed is printed
#   ... --table FILE         appends what was found to FILE, tab-separated, for report.sh:
#                              proof BLOCK/HARNESS ENGINE CPU-SECONDS ASSERTION | cover BLOCK/HARNESS CLOCK COVER | bug BLOCK ASSERTION CLOCK WHAT
# tests/proofs/formal/BLOCK/HARNESS.map, if there, is a techmap that cuts out cells (over-approximation); tests/proofs/formal/BLOCK/flags holds
# Yosys read options. Comment lines at the head of a harness say what is asked there:
#   // cut: INSTANCE...      blocks whose outputs may be anything in any clock (over-approximation)
#   // prove: NAME...        assertions that are proved here, * allowed; the others are left to another harness, not assumed. Default all
#   // engine: induction      k-induction by Yosys instead of PDR; abc-induction: by ABC;
#                           cadical-induction: by CaDiCaL, each assertion by itself (induction.py)
# Exit status: 0 all as it should be, 1 not, 2 wrong call.
set -euo pipefail

here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../../.." && pwd)
block=${1:-}
only=*
[[ $block != */* ]] || { only=${block#*/}; block=${block%%/*}; }
shift || true
bugs= draw= seed=$RANDOM covers="and covers" table=/dev/null
usage() {
  echo "prove.sh: expected BLOCK[/HARNESS] [--assertions | --bugs [--draw N] [--seed S]] [--table FILE] with BLOCK one of $(cd "$here" && ls -d -- */ | tr -d / | xargs), found '$*'" >&2
  exit 2
}
[[ -n $block && -d $here/$block ]] || usage "$block" "$@"
while [[ $# -gt 0 ]]; do
  case $1 in
    --bugs) bugs=yes; shift ;;
    --assertions) covers=; shift ;;
    --draw) [[ ${2:-} =~ ^[1-9][0-9]*$ ]] || usage "$block" "$@"; draw=$2; shift 2 ;;
    --seed) [[ ${2:-} =~ ^[0-9]+$ ]] || usage "$block" "$@"; seed=$2; shift 2 ;;
    --table) [[ $# -ge 2 ]] || usage "$block" "$@"; table=$2; shift 2 ;;
    *) usage "$block" "$@" ;;
  esac
done
seconds=600   # for one proof
flags=$(cat "$here/$block/flags" 2>/dev/null || true)
harnesses=("$here/$block"/$only.sv)
[[ -e ${harnesses[0]} ]] || usage "$block/$only" "$@"
set -f  # a * in a name is a pattern for Yosys, not for files
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# CPU seconds of all children so far, into spent.
cpu() {
  times > "$work/times"  # in a subshell it would count that one's children
  spent=$(awk 'END { for (i = 1; i <= 2; i++) { split($i, t, /[ms]/); s += 60 * t[1] + t[2] } printf "%.1f", s }' "$work/times")
}

# list HARNESS WHAT: the words of its comment line "// WHAT: ..."
list() { sed -n "s,^// $2: *,,p" "$1" | xargs -r printf '%s\n'; }

# write_aiger HARNESS RTL_FOLDER WHAT [ASSERTION]: assert.aig and, where WHAT is "and covers", cover.aig, an output a property, named
# in assert.names and cover.names. A cover is reached when the assertion of its contrary fails. Bits without a value are free.
echo 'module \$cover (input A, input EN); \$assert never (.A(!A), .EN(EN)); endmodule' > "$work/cover_map.v"
write_aiger() {
  local harness=$1 rtl=$2 cut=${1%.sv}.map top files finish covers= blocks= keep= name block_of
  engine=$(list "$harness" engine)
  engine=${engine:-pdr}
  top=$(sed -n 's/^module \([A-Za-z0-9_]*\).*/\1/p' "$harness" | head -1)
  files=
  for name in $(grep -v '^+' "$root/rtl/tc.f"); do
    block_of=$(basename "$name" .sv)
    if list "$harness" cut | grep -qx "u_${block_of#tc_}"; then   # of a block that is cut the ports are enough, and far quicker
      { sed '/^);/q' "$rtl/$name"; echo endmodule; } > "$work/$name"
      files+=" $work/$name"
    else
      files+=" $rtl/$name"
    fi
  done
  [[ -f $cut ]] && cut="techmap -map $cut" || cut=
  for name in $(list "$harness" cut); do blocks+=" */$name"; done
  for name in ${4:-$(list "$harness" prove)}; do keep+=" n:*$name n:*${name}_C"; done
  finish="opt -fast -nodffe -nosdff; dffunmap; setundef -undriven -anyseq; techmap; opt -fast -nodffe -nosdff; dffunmap; aigmap; opt_clean"
  [[ ${3:-} != "and covers" ]] || covers="design -load read
    chformal -assert -remove; techmap -map $work/cover_map.v; setattr -set keep 1 t:\$assert; $finish; write_aiger -zinit $work/cover.aig; tee -o $work/cover.names select -list t:\$assert"
  yosys -q -p "read_verilog -sv -formal -defer -I $rtl $flags $files $harness
    hierarchy -check -top $top; ${blocks:+cutpoint$blocks; hierarchy -top $top;} proc; memory_map; flatten; setattr -set keep 1 t:\$assert t:\$cover; $cut; opt -fast; async2sync; opt_clean; chformal -early
    ${keep:+select -set keep$keep; chformal -assert -cover -remove t:\$assert t:\$cover %u @keep %d;} design -save read
    chformal -cover -remove; write_ilang $work/asserts.il; $finish; write_aiger -zinit $work/assert.aig; tee -o $work/assert.names select -list t:\$assert
    $covers" \
    > "$work/yosys.log" 2>&1 || { echo "prove.sh: $harness: $(grep -m1 ERROR "$work/yosys.log")" >&2; exit 1; }
}
# All assertions as one property, so that each may lean on the others. The words of the tools count, not their exit status.
# prove [ASSERTION]: where each is proved by itself, only this one.
prove() {
  if [[ $engine == induction ]]; then
    yosys -p "read_ilang $work/asserts.il; opt -fast -nodffe -nosdff; dffunmap; opt_clean
              sat -tempinduct -maxsteps 4 -set-assumes -prove-asserts -timeout $seconds" > "$work/abc.log" 2>&1 || true
    grep -q 'Induction step proven: SUCCESS' "$work/abc.log" && return
    return 1
  fi
  if [[ $engine == abc-induction ]]; then
    berkeley-abc -c "read_aiger $work/assert.aig; fold; strash; orpos; ind -F 4 -C 0" > "$work/abc.log" 2>&1 || true
    grep -q 'Networks are equivalent' "$work/abc.log" && return
    return 1
  fi
  if [[ $engine == cadical-induction ]]; then
    berkeley-abc -c "read_aiger $work/assert.aig; fold; strash; dc2; write_aiger $work/small.aig; frames -i -F 2; strash; write_aiger $work/base.aig" > "$work/frames.log" 2>&1 || true
    berkeley-abc -c "read_aiger $work/small.aig; frames -F 3; comb; strash; write_aiger $work/step.aig" >> "$work/frames.log" 2>&1 || true
    /usr/bin/python3 -B "$here/induction.py" "$work/base.aig" "$work/step.aig" "$work/assert.names" "$@" > "$work/abc.log" 2>&1 || true
    grep -qx proved "$work/abc.log" && return
    # A tool that fails refuses no bug.
    grep -qE 'does not follow|refuted' "$work/abc.log" || { echo "prove.sh: induction.py: $(tail -n 1 "$work/abc.log")" >&2; exit 1; }
    return 1
  fi
  berkeley-abc -c "read_aiger $work/assert.aig; fold; strash; orpos; scorr; pdr -T $seconds" > "$work/abc.log" 2>&1 || true
  grep -q 'Property proved' "$work/abc.log"
}
# search ABC-OPTIONS: bounded search for a counterexample, into bmc.log; it names the assertion.
search() { berkeley-abc -c "read_aiger $work/assert.aig; fold; strash; bmc3 $* -T $seconds" > "$work/bmc.log" 2>&1 || true; }
# A counterexample, for a seeded bug: bounded search is what finds it, else PDR.
refute() {
  search -F 200
  cp "$work/bmc.log" "$work/abc.log"
  if ! refuted && [[ $engine == pdr ]]; then prove || ! refuted || search; fi
}
refuted() { grep -aq 'asserted in frame' "$work/abc.log"; }
clock() { grep -am1 'asserted in frame' "$work/abc.log" | sed 's/.*frame *\([0-9]*\).*/\1/'; }

# Name of an assertion that does not hold, and in which clock; else ABC's last words.
failed() {
  local words output
  refuted || { tail -n 1 "$work/abc.log"; return; }
  words=$(grep -a -m1 'asserted in frame' "$work/bmc.log") || { echo "refuted"; return; }
  output=$(sed 's/Output *\([0-9]*\).*/\1/' <<< "$words")
  echo "$(sed -n "$((output + 1))p" "$work/assert.names" | sed 's,.*/,,') in clock $(sed 's/.*frame *\([0-9]*\).*/\1/' <<< "$words")"
}

status=0
say() { echo "$1"; [[ $1 != FAIL* ]] || status=1; }

prove_harness() {
  local name=$1 n reached unreached before spent
  n=$(wc -l < "$work/assert.names")
  cpu; before=$spent
  if [[ $n == 0 ]]; then
    say "FAIL  $name: nothing to prove"
  elif prove; then
    cpu; spent=$(awk "BEGIN { printf \"%.1f\", $spent - $before }")
    say "ok    $name: $n assertions proved"
    sed "s,.*[/.],proof\t$name\t$engine\t$spent\t," "$work/assert.names" >> "$table"
  else
    search -F 100
    cp "$work/bmc.log" "$work/abc.log"
    say "FAIL  $name: $(failed)"
  fi
  [[ $covers ]] || return 0
  n=$(wc -l < "$work/cover.names")
  # Bounded search reaches most in no time; random inputs what lies deeper, or PDR.
  berkeley-abc -c "read_aiger $work/cover.aig; fold; strash; bmc3 -a -x -F 60 -T 20" > "$work/cover.log" 2>&1 || true
  all_reached() { [[ $n == $(grep -ao 'Output *[0-9]* was asserted' "$work/cover.log" | sort -u -k 2n | wc -l) ]]; }
  all_reached || berkeley-abc -c "read_aiger $work/cover.aig; fold; strash; dc2; sim3 -a -F 1000 -T 60" >> "$work/cover.log" 2>&1 || true
  all_reached ||
    berkeley-abc -c "read_aiger $work/cover.aig; fold; strash; pdr -a -T $seconds" >> "$work/cover.log" 2>&1 || true
  grep -ao 'Output *[0-9]* was asserted in frame *[0-9]*' "$work/cover.log" | sed 's/[^0-9]*\([0-9]*\)[^0-9]*\([0-9]*\)/\1 \2/' > "$work/reached" || true
  awk -v name="$name" -v OFS='\t' 'NR == FNR { if (!($1 in clock)) clock[$1] = $2; next }
    { cover = $0; sub(/.*[\/]/, "", cover); sub(/\.never$/, "", cover); sub(/.*\./, "", cover)
      if (FNR - 1 in clock) print "cover", name, clock[FNR - 1], cover }' "$work/reached" "$work/cover.names" >> "$table"
  unreached=$(awk 'NR == FNR { seen[$1] = 1; next } !(FNR - 1 in seen) { sub(/.*\//, ""); sub(/\.never$/, ""); print }' "$work/reached" "$work/cover.names")
  if [[ -z $unreached ]]; then say "ok    $name: $n covers reached"; else say "FAIL  $name: never reached: $(xargs <<< "$unreached")"; fi
}

# Every seeded bug must give a counterexample in some harness of the block; to the assertion that it names, if it names one.
prove_bugs() {
  local file change what wanted found harness
  grep -v '^#' "$here/$block/bugs.txt" | grep . > "$work/bugs"
  if [[ $draw ]]; then
    echo "      $block: $draw of $(wc -l < "$work/bugs") bugs, --seed $seed"
    awk -v seed="$seed" 'BEGIN { srand(seed) } { print rand() "\t" $0 }' "$work/bugs" | sort -n | sed -n "1,${draw}p" | cut -f 2- > "$work/drawn"
    mv "$work/drawn" "$work/bugs"
  fi
  while IFS=$'\t' read -r file change what wanted; do
    rm -rf "$work/rtl" && cp -r "$root/rtl" "$work/rtl"
    sed -i "$change" "$work/rtl/$file"
    if cmp -s "$root/rtl/$file" "$work/rtl/$file"; then
      say "FAIL  $block: '$what': the change no longer applies to rtl/$file"
      continue
    fi
    found=
    for harness in "${harnesses[@]}"; do
      asked "$harness" "${wanted%!}" || continue
      if [[ $wanted == *! ]]; then
        [[ ${#harnesses[@]} == 1 || -n $(list "$harness" prove) ]] || continue
        write_aiger "$harness" "$work/rtl"
        prove "${wanted%!}" || found="${wanted%!} is no longer proved"
        break
      fi
      write_aiger "$harness" "$work/rtl" "" "$wanted"
      [[ -s $work/assert.names ]] || continue
      refute
      if refuted; then found=$(failed); break; fi
    done
    if [[ -z $found ]]; then say "FAIL  $block: proof does not see: $what"; continue; fi
    say "ok    $block: refused: $what ($found)"
    printf 'bug\t%s\t%s\t%s\t%s\n' "$block" "$(sed 's/ .*//; s/.*\.//' <<< "$found")" "$([[ $wanted == *! ]] && echo - || clock)" "$what" >> "$table"
  done < "$work/bugs"
}
# asked HARNESS ASSERTION: is it proved there?
asked() {
  local name
  [[ -n $2 && -n $(list "$1" prove) ]] || return 0
  for name in $(list "$1" prove); do [[ $2 == $name ]] && return 0; done
  return 1
}

if [[ $bugs ]]; then
  prove_bugs
else
  for harness in "${harnesses[@]}"; do
    write_aiger "$harness" "$root/rtl" "$covers"
    prove_harness "$block/$(basename "$harness" .sv)"
  done
fi
exit $status
