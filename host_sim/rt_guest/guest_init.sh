#!/bin/busybox sh
# SPDX-License-Identifier: Apache-2.0
# First process of the guest: mounts, modules, udevd, then the job between two marks.
/bin/busybox --install -s /bin
export PATH=/bin HOME=/tmp
mount -t proc proc /proc
mount -t sysfs sysfs /sys
mount -t devtmpfs devtmpfs /dev
mount -t tmpfs tmpfs /run
mount -t tmpfs tmpfs /tmp
mkdir -p /dev/shm
mount -t tmpfs tmpfs /dev/shm
ip link set lo up
for module in /modules/*.ko; do insmod "$module" || echo "module $module was refused"; done
systemd-udevd --daemon --resolve-names=never
cd /job
echo '=== rt guest: output begins ==='
(
  set --
  . ./.arguments
  . ./.script
)
echo "=== rt guest: exit code $?"
poweroff -f
