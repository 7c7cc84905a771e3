# SPDX-License-Identifier: Apache-2.0
# Sourced by tools/quickstart, tools/check and .ci/run: says each step, names the one that failed, installs packages.

haptic_step="start"

# step <text>: what is being done, and what is blamed when it fails.
step() {
  haptic_step="$1"
  printf '\n==> %s\n' "$1"
}

fail() {
  printf '\n%s: failed at: %s\n%s\n' "$(basename "$0")" "$haptic_step" "${1:-See the messages above.}" >&2
  exit "${2:-1}"
}
trap 'fail "" $?' ERR

# need_packages <package>..: installs those that are missing, with one update of the package list before.
need_packages() {
  step "packages: $*"
  if ! command -v dpkg-query >/dev/null; then
    echo "This is no Debian system; taking the packages above as installed."
    return 0
  fi
  local missing=() package
  for package in "$@"; do
    if [ "$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null)" != installed ]; then
      missing+=("$package")
    fi
  done
  if [ ${#missing[@]} -eq 0 ]; then
    echo "All are installed."
    return 0
  fi
  local as_root=(env DEBIAN_FRONTEND=noninteractive)
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null ||
      fail "Missing packages: ${missing[*]}. Neither root nor sudo here; install them as root: apt-get install ${missing[*]}"
    as_root=(sudo "${as_root[@]}")
  fi
  echo "Installing: ${missing[*]}"
  "${as_root[@]}" apt-get update -q || echo "The package list could not be renewed; trying with the present one."
  "${as_root[@]}" apt-get install -q -y --no-install-recommends "${missing[@]}" ||
    fail "apt-get could not install: ${missing[*]}. Check the network and /etc/apt/sources.list (Debian 12)."
}

# What every build of the project needs.
haptic_build_packages=(g++ cmake ninja-build pkg-config libeigen3-dev libusb-1.0-0-dev doctest-dev libboost-dev
  libgmp-dev libtomlplusplus-dev libcli11-dev nlohmann-json3-dev)

# What users would pick instead, for the report of error against run time; built without where absent.
haptic_peer_packages=(libccd-dev libbullet-dev)

# configure <preset> [cmake options]: a build folder that was made for another place is made anew.
configure() {
  local preset="$1" cache="build/$1/CMakeCache.txt" fresh=()
  shift
  if [ -f "$cache" ] && ! grep -qxF "CMAKE_HOME_DIRECTORY:INTERNAL=$PWD" "$cache"; then
    fresh=(--fresh)
  fi
  step "configure preset $preset"
  cmake "${fresh[@]}" --preset "$preset" "$@"
}

# build <preset> [cmake --build options]
build() {
  local preset="$1"
  shift
  step "build preset $preset on $(nproc) cores"
  cmake --build --preset "$preset" --parallel "$(nproc)" "$@"
}
