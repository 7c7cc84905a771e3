# SPDX-License-Identifier: Apache-2.0
# Toolchain: a Cortex-M7 with double precision floating point, no operating system. On Debian: gcc-arm-none-eabi
# libnewlib-arm-none-eabi libstdc++-arm-none-eabi-newlib.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR cortex-m7)
set(CMAKE_CXX_COMPILER arm-none-eabi-g++)
# -Wno-psabi: remarks on how g++ 6 passed arguments, which nothing here was built with.
set(CMAKE_CXX_FLAGS_INIT "-mthumb -mcpu=cortex-m7 -mfloat-abi=hard -mfpu=fpv5-d16 -Wno-psabi")
# Its test program would need start-up code.
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
# Eigen is headers and the same for every machine: found where this machine has it.
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
