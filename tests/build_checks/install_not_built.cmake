# SPDX-License-Identifier: Apache-2.0
# Installs a build folder in which nothing is built. That it is refused is what the probe expects; that anything is placed all
# the same is told instead.
# cmake -DSOURCE=<project> -DCOMPILER=<c++> -DFOLDER=<work> -P install_not_built.cmake
cmake_minimum_required(VERSION 3.25)

file(REMOVE_RECURSE ${FOLDER})
execute_process(COMMAND ${CMAKE_COMMAND} -S ${SOURCE} -B ${FOLDER}/build -G Ninja -DCMAKE_CXX_COMPILER=${COMPILER}
  -DHAPTIC_BUILD_TESTS=OFF OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${CMAKE_COMMAND} --install ${FOLDER}/build --prefix ${FOLDER}/prefix
  OUTPUT_VARIABLE output ERROR_VARIABLE output RESULT_VARIABLE code)
if(EXISTS ${FOLDER}/prefix)
  message(FATAL_ERROR "installed: something is placed of what is not built\n${output}")
endif()
if(code)
  message(FATAL_ERROR "${output}")
endif()
