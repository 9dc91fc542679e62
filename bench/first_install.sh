#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# first_install.sh FOLDER: what a newcomer waits for who installs the Debian package. Makes a bare Debian 12 in FOLDER (debootstrap; root
# needed), installs the package that `./run packages` made, prints the first example, and prints packages, megabytes and times.
# FOLDER must not exist; it is left for a look. Exit status: 0 all as wanted, 1 a figure falls short, 2 wrong use.
set -euo pipefail
[[ $# == 1 && ! -e $1 ]] || { echo "first_install.sh: expected a folder that doesn't exist yet, found '$*'" >&2; exit 2; }
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P)
mapfile -t debs < <(compgen -G "$root/build/release/packages/meltstage_*.deb")
[[ ${#debs[@]} == 1 ]] || { echo "first_install.sh: found ${#debs[@]} packages meltstage in build/release/packages, expected one: ./run packages" >&2; exit 2; }
bare=$1
source "$root/bench/bare_debian.sh"
make_bare_debian
packages >"$bare.before"
in_it apt-get -q update >/dev/null
cp "${debs[0]}" "$bare/root/meltstage.deb"
TIMEFORMAT=%R
{ time in_it env DEBIAN_FRONTEND=noninteractive apt-get -q -y --no-install-recommends install /root/meltstage.deb >"$bare.install" 2>&1; } 2>"$bare.installed"
packages >"$bare.after"
{ time in_it /bin/bash -c 'cd /root && meltstage print /usr/share/meltstage/examples/first.toml' >&2; } 2>"$bare.printed"
[[ -s $bare/root/out/first/report.html ]] || { echo "first_install.sh: found no page of the print, expected out/first/report.html" >&2; exit 1; }

row "packages installed" "$(comm -13 "$bare.before" "$bare.after" | wc -l)" "" 60
row "size of the package" "$(du --apparent-size -k "${debs[0]}" | awk '{ printf "%.1f", $1 / 1000 }')" MB 20
row "installation, by the clock" "$(tail -n 1 "$bare.installed")" s
row "first print, by the clock" "$(tail -n 1 "$bare.printed")" s 60
exit $status
