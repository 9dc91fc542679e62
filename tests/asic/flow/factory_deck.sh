#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# factory_deck.sh FOLDER TOP FLOW TECH PLACER ROUTER: runs `make ... factory` on a copy of a routed layout: with a deck that isn't there, with one whose rule
# the layout keeps, and with one whose rule it breaks. Each must be told as what it is.
set -euo pipefail
folder=$1 top=$2 flow=$3 tech=$4
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$work/$tech"
cp -a "$folder" "$work/$tech/$top"
unset MAKEFLAGS MAKELEVEL
factory() { make -s -C "$flow" BUILD="$work" TECH="$tech" TOP="$top" PLACER="$5" ROUTER="$6" FACTORY_DECK="$7" factory 2>&1; }

told=$(factory "$@" "$work/nosuch.lydrc") && { echo "a missing deck went by"; exit 1; }
grep -q "nosuch.lydrc: no such file, expected the deck" <<<"$told"
# deck SPACE_NM: as IHP's decks tell what they find.
deck() {
  cat >"$work/deck.drc" <<EOT
source(\$in_gds)
report("deck", \$report_file)
metal = input($(sed -n 's/.*"name": "metal3", "gds": \[\([0-9]*\), \([0-9]*\)\].*/\1, \2/p' "$flow/tech/${tech}_rules.json"))
puts "Rule metal3.width: %d error(s)" % metal.width($1.nm).count
puts "Rule metal3.there: %d error(s)" % (metal.count > 0 ? 0 : 1)
EOT
}
deck 100
told=$(factory "$@" "$work/deck.drc")
grep -q "^2 rules, 0 errors; of density: 0$" <<<"$told" || { echo "$told"; exit 1; }
deck 5000
told=$(factory "$@" "$work/deck.drc")
grep -q "^2 rules, [1-9][0-9]* errors; of density: 0$" <<<"$told" || { echo "$told"; exit 1; }
echo "puts nosuch" >"$work/deck.drc"
told=$(factory "$@" "$work/deck.drc") && { echo "a deck that stops went by"; exit 1; }
grep -q "expected a deck that this KLayout reads" <<<"$told"
