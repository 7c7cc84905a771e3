# SPDX-License-Identifier: Apache-2.0
# Rule: a project that adds this one as a folder gets the libraries alone, and none of our flags in its own code.
# cmake -DPROJECT=<folder of that project> -DROOT=<this project> -DFOLDER=<build> -DCOMPILER=<c++> [-DLEAK=ON] -P embedding.cmake
cmake_minimum_required(VERSION 3.25)

file(REMOVE_RECURSE ${FOLDER})
execute_process(COMMAND ${CMAKE_COMMAND} -S ${PROJECT} -B ${FOLDER} -G Ninja -DHAPTIC_ROOT=${ROOT} -DLEAK=${LEAK}
  -DCMAKE_CXX_COMPILER=${COMPILER} OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
set(violations)
file(STRINGS ${FOLDER}/compile_commands.json commands REGEX "^ *\"command\": ")
foreach(command IN LISTS commands)
  if(command MATCHES "/own\\.cpp\"")
    if(command MATCHES " (-W[^ ]*|-f[^ ]*|-O[^ ]*|-m[^ ]*|-DEIGEN[^ ]*)")
      string(APPEND violations "  own.cpp is compiled with ${CMAKE_MATCH_1}\n")
    endif()
  elseif(command MATCHES "(${ROOT}/(tests|host_sim|tools/(scene_inspect|run_device|graph_compiler/program))/[^ \"]*)")
    string(APPEND violations "  ${CMAKE_MATCH_1} is built\n")
  endif()
endforeach()
file(STRINGS ${FOLDER}/own.txt own)
if(NOT own STREQUAL "${FOLDER}/own")
  string(APPEND violations "  the program lies in ${own}\n")
endif()
if(NOT commands)
  string(APPEND violations "  no compile command in ${FOLDER}\n")
endif()
if(violations)
  message(FATAL_ERROR "embedding: a user's project is changed by ours\n${violations}")
endif()
