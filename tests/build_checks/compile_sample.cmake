# SPDX-License-Identifier: Apache-2.0
# Compiles one sample with the core's own flags, then runs `CHECK` on it.
# cmake -DCOMPILER=.. -DFLAGS=a|b|c -DSAMPLE=<file.cpp> -DFOLDER=<output> -DROOT=<project> -DCHECK=<archive|stack|none>
#       -P compile_sample.cmake
cmake_minimum_required(VERSION 3.25)

if(SKIP)
  message("skipped: ${SKIP}")
  return()
endif()
string(REPLACE "|" ";" flags "${FLAGS}")
list(REMOVE_ITEM flags "")
cmake_path(GET SAMPLE FILENAME name)
file(REMOVE_RECURSE ${FOLDER})
file(MAKE_DIRECTORY ${FOLDER})
execute_process(COMMAND ${COMPILER} ${flags} -I${ROOT} -c ${SAMPLE} -o ${FOLDER}/${name}.o RESULT_VARIABLE code)
if(code)
  message(FATAL_ERROR "${name} does not compile")
endif()
if(CHECK STREQUAL "archive")
  execute_process(COMMAND ${AR} qc ${FOLDER}/sample.a ${FOLDER}/${name}.o COMMAND_ERROR_IS_FATAL ANY)
  set(ARCHIVE ${FOLDER}/sample.a)
  include(${CMAKE_CURRENT_LIST_DIR}/archive_symbols.cmake)
elseif(CHECK STREQUAL "stack")
  include(${CMAKE_CURRENT_LIST_DIR}/../../linker/stack_bound.cmake)
endif()
