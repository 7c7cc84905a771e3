# SPDX-License-Identifier: Apache-2.0
# Rule: the freestanding image computes the same bits as the hosted program, and leaves room on its stack.
# cmake -DIMAGE=<image> -DHOSTED=<program> -P same_bits.cmake
cmake_minimum_required(VERSION 3.25)

foreach(name IMAGE HOSTED)
  execute_process(COMMAND ${${name}} OUTPUT_VARIABLE ${name}_text RESULT_VARIABLE code)
  if(NOT ${name}_text MATCHES "^(verdict [0-9]+ ticks [0-9]+ contact [0-9]+ hash [0-9a-f]+)\n")
    message(FATAL_ERROR "same bits: ${${name}} ended with '${code}' and printed '${${name}_text}'")
  endif()
  set(${name}_line "${CMAKE_MATCH_1}")
  if(code)
    message(FATAL_ERROR "same bits: ${${name}} failed: ${${name}_line} (verdicts: linker/image_run.hpp)")
  endif()
endforeach()
if(NOT IMAGE_line STREQUAL HOSTED_line)
  message(FATAL_ERROR "same bits: the two differ\n  image  ${IMAGE_line}\n  hosted ${HOSTED_line}")
endif()
if(NOT IMAGE_text MATCHES "stack ([0-9]+) of ([0-9]+) bytes" OR CMAKE_MATCH_1 GREATER_EQUAL CMAKE_MATCH_2)
  message(FATAL_ERROR "same bits: the image used all of its stack: ${IMAGE_text}")
endif()
message("same bits: ${IMAGE_line}; stack ${CMAKE_MATCH_1} of ${CMAKE_MATCH_2} bytes")
