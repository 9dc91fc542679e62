# shellcheck shell=bash disable=SC2154
# SPDX-License-Identifier: Apache-2.0
# Sourced by scripts that measure what a newcomer meets on a bare Debian 12. Expects `bare`, a folder that doesn't exist yet.

# Makes it (debootstrap; root needed), with this machine's way to Debian's packages. /proc and /dev are there until the script ends.
make_bare_debian() {
  command -v debootstrap >/dev/null || { echo "${0##*/}: found no debootstrap, expected it installed: apt-get install debootstrap" >&2; exit 2; }
  debootstrap --variant=minbase bookworm "$bare" >"$bare.log" 2>&1 || { tail -n 1 "$bare.log" >&2; exit 2; }
  rm -f "$bare/etc/apt/sources.list"
  cp -r /etc/apt/apt.conf.d /etc/apt/sources.list* "$bare/etc/apt/"
  cp /etc/resolv.conf "$bare/etc/"
  mount -t proc proc "$bare/proc"
  mount --rbind /dev "$bare/dev"
  trap 'umount -l "$bare/dev" "$bare/proc"' EXIT
}

in_it() { chroot "$bare" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root "$@"; }
packages() { in_it dpkg-query -W -f='${Package}\n' | sort; }

status=0
row() { # what, value, unit, wanted at most
  local mark=
  awk -v v="$2" -v w="${4:-}" 'BEGIN { exit !(w == "" || v <= w) }' || { mark=SHORT status=1; }
  printf '%-32s %10s %-14s %-8s %s\n' "$1" "$2" "$3" "${4:+<= $4}" "$mark"
}
