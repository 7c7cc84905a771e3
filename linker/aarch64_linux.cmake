# SPDX-License-Identifier: Apache-2.0
# Toolchain: 64-bit Arm with Linux; its programs run here in user-mode emulation. On Debian: g++-aarch64-linux-gnu
# qemu-user.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_CROSSCOMPILING_EMULATOR qemu-aarch64;-L;/usr/aarch64-linux-gnu)
# Eigen and doctest are headers and the same for every machine: found where this machine has them.
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
