#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Proof that rtl/tc_algor.sv and cmodel/algor_kernel.hpp are equal for every state and input. Yosys writes the RTL as SMT-LIB 2,
# prove_algor does the rest.
#   prove.sh PROGRAM                  PROGRAM: prove_algor; prints what was proved, or a counterexample
#   prove.sh PROGRAM --rtl-changes    every line of rtl_changes.txt, on a copy of the RTL, must be refuted
#   prove.sh FOLDER --kernel-changes  every line N of kernel_changes.txt, built as FOLDER/N/prove_algor from the changed kernel
#                                     FOLDER/N/cmodel/algor_kernel.hpp, must be refuted
# Exit status: 0 all as it should be, 1 not, 2 wrong call.
set -euo pipefail

here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../../.." && pwd)
subject=${1:-}
mode=${2:-}
if [[ ! -e $subject || ( -n $mode && $mode != --rtl-changes && $mode != --kernel-changes ) ]]; then
  echo "prove.sh: expected PROGRAM, PROGRAM --rtl-changes or FOLDER --kernel-changes, found '$*'" >&2
  exit 2
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# write_smt RTL_FOLDER: algor.smt2, the RTL as it is synthesised (assertions left out).
write_smt() {
  yosys -q -p "read_verilog -sv -D SYNTHESIS -I $1 $1/tc_pkg.sv $1/tc_math_pkg.sv $1/tc_algor.sv
    hierarchy -check -top tc_algor; proc; flatten; opt_clean; async2sync; dffunmap; opt_clean
    write_smt2 -wires $work/algor.smt2" > "$work/yosys.log" 2>&1 ||
    { echo "prove.sh: $1: $(grep -m1 ERROR "$work/yosys.log")" >&2; exit 1; }
}

status=0
say() { echo "$1"; [[ $1 != FAIL* ]] || status=1; }

# refuse PROGRAM WHAT: it must find a counterexample, and the kernel on integers must bear the solver out.
refuse() {
  local found=0
  "$1" "$work/algor.smt2" --first > "$work/proof.log" || found=$?
  if [[ $found != 1 ]]; then
    say "FAIL  proof does not see: $2"
  elif grep -q 'NOT what the solver says' "$work/proof.log"; then
    say "FAIL  $2: the kernel on integers does not give what the solver says"
  else
    say "ok    refuted: $2 ($(grep -m1 -o 'counterexample: .*\|.* in reset: .*' "$work/proof.log"))"
  fi
}

changes() { grep -v '^#' "$here/$1"; }

case $mode in
  --rtl-changes)
    while IFS=$'\t' read -r file change what; do
      rm -rf "$work/rtl" && cp -r "$root/rtl" "$work/rtl"
      sed -i "$change" "$work/rtl/$file"
      if cmp -s "$root/rtl/$file" "$work/rtl/$file"; then
        say "FAIL  '$what': the change no longer applies to rtl/$file"
        continue
      fi
      write_smt "$work/rtl"
      refuse "$subject" "$what"
    done < <(changes rtl_changes.txt)
    ;;
  --kernel-changes)
    write_smt "$root/rtl"
    number=0
    while IFS=$'\t' read -r change what; do
      number=$((number + 1))
      if cmp -s "$root/cmodel/algor_kernel.hpp" "$subject/$number/cmodel/algor_kernel.hpp"; then
        say "FAIL  '$what': the change no longer applies to cmodel/algor_kernel.hpp"
        continue
      fi
      refuse "$subject/$number/prove_algor" "$what"
    done < <(changes kernel_changes.txt)
    ;;
  *)
    write_smt "$root/rtl"
    "$subject" "$work/algor.smt2" || status=$?
    ;;
esac
exit $status
