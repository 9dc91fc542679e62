# shellcheck shell=bash disable=SC2154
# SPDX-License-Identifier: Apache-2.0
# Sourced by ./run and ./check: what both need before they can do their job.
# Expects `root`, the project's folder. Every step does nothing when its work is done already.
export LC_ALL=C.UTF-8

# One line to the user, then the end.
stop() {
  echo "${0##*/}: $*" >&2
  exit 1
}

# packages_of TIER...: their names in packages.txt.
packages_of() {
  awk -v tiers=" $* " '/^\[/ { gsub(/[][]/, "", $1); tier = $1; next } index(tiers, " " tier " ") && !/^ *(#|$)/ { print $1 }' "$root/packages.txt" | sort -u
}

# install_packages TIER...: installs the packages of these tiers of packages.txt that are missing; asks for nothing when none is.
install_packages() {
  if ! command -v dpkg-query >/dev/null || ! command -v apt-get >/dev/null; then
    stop "no dpkg-query or apt-get here, expected Debian 12; install what packages.txt names, then: cmake --preset release"
  fi
  local wanted installed missing as_root=()
  mapfile -t wanted < <(packages_of "$@")
  # exits with 1 when a name is unknown to it, which is one of the answers wanted
  installed=$(dpkg-query -W -f='${db:Status-Status} ${Package}\n' "${wanted[@]}" 2>/dev/null | sed -n 's/^installed //p' | sort -u) || true
  mapfile -t missing < <(comm -23 <(printf '%s\n' "${wanted[@]}") <(echo "$installed"))
  [ ${#missing[@]} -gt 0 ] || return 0
  if [ "$(id -u)" != 0 ]; then
    command -v sudo >/dev/null || stop "neither root nor sudo here; as root, first: apt-get install ${missing[*]}"
    as_root=(sudo)
  fi
  mkdir -p "$root/build"
  local log=$root/build/packages.log
  echo "Installing from Debian, this once, for $*: ${missing[*]}"
  if ! { "${as_root[@]}" apt-get -q -o DPkg::Lock::Timeout=120 update &&
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -q -y -o DPkg::Lock::Timeout=120 \
      --no-install-recommends install "${missing[@]}"; } >"$log" 2>&1; then
    stop "cannot install packages: $(grep -m1 '^E:' "$log" || tail -n1 "$log") (all of it in build/packages.log)"
  fi
}

# Options MELTSTAGE_... of CMakeLists.txt.
all_parts=(VISION SILICON HLS SYSTEMC LIVE PAGE PYTHON BENCHES DOCS TESTS)

# configure PRESET PART...: makes the build folder with these parts alone when it isn't ready, is older than the presets, or was made
# elsewhere. In one that is there a part that is wanted now is added, and one that is there stays.
configure() {
  local folder=$root/build/$1 cache=$root/build/$1/CMakeCache.txt wanted=" ${*:2} " part options=()
  local call=(cmake --log-level=NOTICE --preset "$1") title="Configuring build/$1"
  if [ "$folder/build.ninja" -nt "$root/CMakePresets.json" ] && grep -qxF "CMAKE_HOME_DIRECTORY:INTERNAL=$root" "$cache"; then
    for part in "${all_parts[@]}"; do
      if [[ $wanted == *" $part "* ]]; then
        grep -q "^MELTSTAGE_$part:BOOL=ON" "$cache" || options+=("-DMELTSTAGE_$part=ON")
      elif ! grep -q "^MELTSTAGE_$part:BOOL=" "$cache"; then # younger than the folder
        options+=("-DMELTSTAGE_$part=OFF")
      fi
    done
    [ ${#options[@]} -gt 0 ] || return 0
    title+=" for more"
  else
    for part in "${all_parts[@]}"; do
      [[ $wanted == *" $part "* ]] && options+=("-DMELTSTAGE_$part=ON") || options+=("-DMELTSTAGE_$part=OFF")
    done
    call+=(--fresh)
  fi
  echo "$title"
  (cd "$root" && "${call[@]}" "${options[@]}")
}

# build PRESET TARGET...
build() {
  local preset=$1
  shift
  local call=(cmake --build --preset "$preset" -j "$(nproc)" --target "$@")
  if [ -t 1 ]; then
    (cd "$root" && "${call[@]}")
  else # a pipe hears nothing where nothing is to do
    (cd "$root" && "${call[@]}") | sed -u '/Re-checking globbed directories\.\.\.$/d; /^ninja: no work to do\.$/d'
  fi
}
