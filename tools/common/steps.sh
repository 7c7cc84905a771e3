# SPDX-License-Identifier: Apache-2.0
# Sourced by tools/quickstart, tools/check and .ci/run: says each step, names the one that failed, installs packages.

haptic_step="start" haptic_packages_s=0

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

# missing_packages <package>..: those that are not installed, a line each.
missing_packages() {
  local package
  for package in "$@"; do
    [ "$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null)" = installed ] || echo "$package"
  done
}

# install_packages <package>..: with one update of the package list before; where it cannot, says why and is not zero.
install_packages() {
  local as_root=(env DEBIAN_FRONTEND=noninteractive) patience=(-o Acquire::http::Timeout=20) since="$SECONDS"
  if [ "$(id -u)" -ne 0 ]; then
    if ! command -v sudo >/dev/null; then
      echo "Neither root nor sudo here; install them as root: apt-get install $*"
      return 1
    fi
    as_root=(sudo "${as_root[@]}")
  fi
  echo "Installing: $*"
  "${as_root[@]}" apt-get "${patience[@]}" update -q ||
    echo "The package list could not be renewed; trying with the present one."
  if "${as_root[@]}" apt-get "${patience[@]}" install -q -y --no-install-recommends "$@"; then
    haptic_packages_s=$((haptic_packages_s + SECONDS - since))
    echo "Installed in $((SECONDS - since)) s."
    return
  fi
  echo "apt-get could not install: $*. Check the network and /etc/apt/sources.list (Debian 12)."
  return 1
}

# need_packages <package>..: installs those that are missing, or fails.
need_packages() {
  step "packages: $*"
  if ! command -v dpkg-query >/dev/null; then
    echo "This is no Debian system; taking the packages above as installed."
    return 0
  fi
  local missing
  mapfile -t missing < <(missing_packages "$@")
  if [ ${#missing[@]} -eq 0 ]; then
    echo "All are installed."
    return 0
  fi
  install_packages "${missing[@]}" || fail "Missing packages: ${missing[*]}"
}

# want_packages <package>..: as need_packages where nobody has to be asked for a password; goes on without them.
want_packages() {
  step "packages that may be missing: $*"
  local missing
  mapfile -t missing < <(missing_packages "$@" 2>/dev/null)
  if [ ${#missing[@]} -eq 0 ]; then
    echo "All are installed."
  elif ! command -v dpkg-query >/dev/null; then
    echo "This is no Debian system; going on with what is there."
  elif [ "$(id -u)" -ne 0 ] && ! sudo -n true 2>/dev/null; then
    echo "Going on without: ${missing[*]}"
  else
    install_packages "${missing[@]}" || echo "Going on without: ${missing[*]}"
  fi
}

# What every build of the project needs.
haptic_build_packages=(g++ cmake ninja-build pkg-config libeigen3-dev libusb-1.0-0-dev doctest-dev libboost-dev
  libgmp-dev libtomlplusplus-dev libcli11-dev nlohmann-json3-dev)

# What the guest with a PREEMPT_RT kernel needs; its test is skipped where they are absent.
haptic_guest_packages=(qemu-system-x86 seabios cpio kmod busybox-static)

# What users would pick instead, for the report of error against run time; built without where absent.
haptic_peer_packages=(libccd-dev libbullet-dev)

# What the tests of the Python package need; they are skipped where it is absent.
haptic_python_packages=(python3-numpy)

# What makes Debian packages: dpkg-dev finds what a program depends on, and cpack asks file which files are programs.
haptic_deb_packages=(file dpkg-dev)

# What looks at the interface of the library and at the Debian packages; those checks are skipped where absent.
haptic_release_packages=(abigail-tools lintian)

# A browser without a window, which the tests of the page open it in; they are skipped where it is absent.
haptic_browser_packages=(chromium-headless-shell)

# Libraries that read more mesh formats; such files are refused and their tests skipped where absent.
haptic_import_packages=(libassimp-dev libtinyxml2-dev zlib1g-dev)

# Compilers and emulators of the machines that the core is compared on; their tests are skipped where absent.
haptic_target_packages=(gcc-arm-none-eabi libnewlib-arm-none-eabi libstdc++-arm-none-eabi-newlib qemu-system-arm
  g++-aarch64-linux-gnu qemu-user)

# What the page needs: the core as WebAssembly, and the page's own packages by npm. Its tests are skipped where absent.
haptic_page_packages=(clang-16 llvm-16 lld-16 wasi-libc libc++-16-dev-wasm32 libc++abi-16-dev-wasm32
  libclang-rt-16-dev-wasm32 zlib1g-dev)
# node and npm may come from elsewhere than Debian, whose packages would not go with them.
command -v npm >/dev/null || haptic_page_packages+=(nodejs npm)

# configure <preset> [cmake options]: a build folder that was made for another place is made again.
configure() {
  local preset="$1" cache="build/$1/CMakeCache.txt" fresh=()
  shift
  if [ -f "$cache" ] && ! grep -qxF "CMAKE_HOME_DIRECTORY:INTERNAL=$PWD" "$cache"; then
    fresh=(--fresh)
  fi
  step "configure preset $preset"
  cmake "${fresh[@]}" --preset "$preset" "$@"
}

# configure_quick: preset release with no more than tools/quickstart and tools/view need; a folder of the whole project stays one.
configure_quick() {
  if [ -f build/release/CMakeCache.txt ] && ! grep -qx 'HAPTIC_QUICKSTART:BOOL=ON' build/release/CMakeCache.txt; then
    configure release
  else
    configure release -DHAPTIC_QUICKSTART=ON
  fi
}

# minutes <name>: what tools/common/minutes.txt states of this command for two cores, as measured, scaled
# to this machine; said at the start.
minutes() {
  local cores halves stated
  stated="$(awk -v name="$1" '$1 == name { print $2 }' tools/common/minutes.txt)"
  cores="$(nproc)"
  halves=$(( (stated * 4 + cores - 1) / cores ))
  printf 'This takes about %d.%d minutes on %d cores the first time, much less again; packages to install aside.\n' \
    $((halves / 2)) $((halves % 2 * 5)) "$cores"
}

# took: the minutes so far, and the processor time of this command and of all that it has waited for; said at the end.
took() {
  awk -v wall="$SECONDS" -v packages="$haptic_packages_s" -v ticks_per_s="$(getconf CLK_TCK)" '{
      sub(/^.*\) /, "")  # number and name of the process
      cpu = ($12 + $13 + $14 + $15) / ticks_per_s
      printf "This took %.1f minutes (%.1f of them for packages) and %.0f CPU seconds.\n", wall / 60, packages / 60, cpu
    }' "/proc/$$/stat"
}

# build <preset> [cmake --build options]: each line says how much is done, and the seconds so far.
build() {
  local preset="$1"
  shift
  step "build preset $preset on $(nproc) cores"
  export NINJA_STATUS='[%f of %t, %e s] '
  cmake --build --preset "$preset" --parallel "$(nproc)" "$@"
}

# all_but_summary <file>: passes CTest's output on as it comes, but its summary at the end to the file.
all_but_summary() {
  local line
  : >"$1"
  while IFS= read -r line; do
    if [[ "$line" =~ ^[0-9]+%\ tests\ passed ]]; then
      { echo "$line" && cat; } >"$1"
    else
      printf '%s\n' "$line"
    fi
  done
}

# not_checked <log of CTest>..: a line for each reason for which something was skipped, with the tests that say so.
not_checked() {
  awk '/^[0-9]+\/[0-9]+ Test: / { test = $3 }
    match($0, /(^|: )(SKIPPED|skipped): /) {
      reason = substr($0, RSTART + RLENGTH)
      if (!(reason in tests)) order[++count] = reason
      if (index(" " tests[reason], " " test ",") == 0) { tests[reason] = tests[reason] " " test ","; ++times[reason] }
    }
    END {
      for (k = 1; k <= count; ++k) {
        split(tests[order[k]], names, ", ?")
        said = names[1]
        for (i = 2; i <= times[order[k]] && i <= 4; ++i) said = said ", " names[i]
        sub(/^ /, "", said)
        if (times[order[k]] > 4) said = said " and " times[order[k]] - 4 " more"
        print "NOT CHECKED: " order[k] " (" said ")"
      }
    }' "$@"
}
