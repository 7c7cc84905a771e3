# SPDX-License-Identifier: Apache-2.0
# Toolchain: WebAssembly with 32-bit addresses, for the page. On Debian: clang-16 llvm-16 lld-16 wasi-libc libc++-16-dev-wasm32
# libc++abi-16-dev-wasm32 libclang-rt-16-dev-wasm32.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR wasm32)
set(CMAKE_CXX_COMPILER clang++-16)
set(CMAKE_CXX_COMPILER_TARGET wasm32-wasi)
set(CMAKE_AR llvm-ar-16)
set(CMAKE_RANLIB llvm-ranlib-16)
# Debian has the headers of libc++ beside the compiler and not in the folder of the C library.
# Lanes of facets are compared four at a time: every browser since 2023 has these instructions, and they change no bit.
set(CMAKE_CXX_FLAGS_INIT "-msimd128 -stdlib++-isystem /usr/lib/llvm-16/include/wasm32-wasi/c++/v1")
# Its test program would need an entry point.
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
# Eigen is headers and the same for every machine: found where this machine has it.
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
