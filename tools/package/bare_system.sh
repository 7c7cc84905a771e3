# SPDX-License-Identifier: Apache-2.0
# Sourced, after tools/common/steps.sh, by what is tried on a bare Debian 12: makes one in a folder and enters it. What is
# mounted and what is started there is in namespaces of the command's own, and gone with it, however it ends.

debian_release=bookworm

# in_own_namespaces <argument>..: runs the script again, with these arguments, where its mounts and processes are its own, and
# ends with its exit code; there it returns, and own_folder is a folder that is removed at the end. Exit 4 where the machine
# refuses that.
in_own_namespaces() {
  local script code=0 pid
  own_folder="${HAPTIC_OWN_FOLDER:-}"
  [ -z "$own_folder" ] || return 0
  script="$(readlink -f "$0")"
  step "namespaces for mounts and processes"
  [ "$(id -u)" -eq 0 ] || fail "Only root may make a Debian: sudo $script $*" 4
  unshare --mount --pid --fork --propagation private --mount-proc true ||
    fail "This machine lets not even root have mounts of its own (a container without CAP_SYS_ADMIN?); take another." 4
  own_folder="$(mktemp -d --tmpdir bare_debian.XXXXXX)"
  trap 'rm -rf --one-file-system "$own_folder"' EXIT
  HAPTIC_OWN_FOLDER="$own_folder" unshare --mount --pid --fork --kill-child --propagation private --mount-proc \
    "$script" "$@" &
  pid=$!
  # With unshare goes its child, the first process of the namespace, and with that all others.
  trap 'kill -KILL "$pid"; wait "$pid" || true; exit 130' INT TERM HUP
  wait "$pid" || code=$?
  exit "$code"
}

# debian_sources: a line for each source of packages that makes a bare Debian. HAPTIC_MIRROR; else those of this machine,
# where it has the same release; else none, which is mmdebstrap's own default, Debian's.
debian_sources() {
  if [ -n "${HAPTIC_MIRROR:-}" ]; then
    echo "$HAPTIC_MIRROR"
    return
  fi
  apt-get indextargets --no-release-info --format 'deb $(REPO_URI) $(RELEASE) $(COMPONENT)' 'Created-By: Packages' |
    grep -E " $debian_release(-updates|-security)? main\$" | sort -u || true
}

# make_debian <folder or .tar file> <variant of mmdebstrap> [package]..: a new one, with these packages besides.
make_debian() {
  local place="$1" variant="$2" sources include=()
  shift 2
  [ $# -eq 0 ] || include=(--include="$(IFS=,; echo "$*")")
  mapfile -t sources < <(debian_sources)
  mmdebstrap --quiet --variant="$variant" "${include[@]}" "$debian_release" "$place" "${sources[@]}" ||
    fail "mmdebstrap could not make it; check the network, or give another HAPTIC_MIRROR.
Its sources: ${sources[*]:-its own default}"
}

# enter_debian <folder>: mounts what every program expects, and takes the machine's way to the network. Of devices there are
# those of any machine and none of this one's.
enter_debian() {
  local root="$1" name
  mount -t proc proc "$root/proc"
  mount -t sysfs -o ro sysfs "$root/sys"
  mount -t tmpfs -o mode=755 tmpfs "$root/dev"
  mkdir "$root/dev/pts" "$root/dev/shm"
  for name in null zero full random urandom tty; do
    touch "$root/dev/$name"
    mount --bind "/dev/$name" "$root/dev/$name"
  done
  mount -t devpts -o newinstance,ptmxmode=666,mode=620,gid=5 devpts "$root/dev/pts"
  mount -t tmpfs -o mode=1777,nosuid,nodev tmpfs "$root/dev/shm"
  ln -s pts/ptmx "$root/dev/ptmx"
  ln -s /proc/self/fd "$root/dev/fd"
  for name in 0:stdin 1:stdout 2:stderr; do
    ln -s "/proc/self/fd/${name%:*}" "$root/dev/${name#*:}"
  done
  cp -L /etc/resolv.conf "$root/etc/resolv.conf"
  printf '127.0.0.1 localhost\n127.0.1.1 %s\n' "$(uname -n)" >"$root/etc/hosts"
}

# inside_debian <folder> <user> <command>..: as that user, with the limits that a user has there, nothing of this machine's
# environment and nobody to answer a question.
inside_debian() {
  local root="$1" user="$2" home
  shift 2
  home="$(awk -F: -v user="$user" '$1 == user { print $6 }' "$root/etc/passwd")"
  env -i PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin HOME="$home" USER="$user" LOGNAME="$user" \
    LC_ALL=C.UTF-8 prlimit --rtprio=0 --nice=0 --memlock=8388608 --core=0 \
    chroot "$root" setpriv --reuid="$user" --regid="$user" --init-groups -- "$@" </dev/null
}
