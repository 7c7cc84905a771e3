# SPDX-License-Identifier: Apache-2.0
# Rule: every function of the core in the final program lies inside .rt_text, the scene and the state in their regions.
# cmake -DPROGRAM=<program> -DARCHIVE=<librt_core.a> -DNM=<nm> -P placement.cmake
cmake_minimum_required(VERSION 3.25)

function(nm_lines out)
  execute_process(COMMAND ${NM} -P --defined-only ${ARGN} OUTPUT_VARIABLE text COMMAND_ERROR_IS_FATAL ANY)
  string(REGEX REPLACE "[][;]" "|" text "${text}")
  string(REPLACE "\n" ";" text "${text}")
  set(${out} "${text}" PARENT_SCOPE)
endfunction()

# Addresses are compared as text of equal length.
function(padded out address)
  string(LENGTH "${address}" length)
  math(EXPR missing "16 - ${length}")
  string(REPEAT 0 ${missing} zeros)
  set(${out} "${zeros}${address}" PARENT_SCOPE)
endfunction()

nm_lines(lines ${PROGRAM})
foreach(line IN LISTS lines)
  if(line MATCHES "^([^ ]+) [A-Za-z] ([0-9a-f]+)")
    padded(at_${CMAKE_MATCH_1} ${CMAKE_MATCH_2})
  endif()
endforeach()

set(violations)
set(count 0)
function(inside symbol region)
  if(NOT DEFINED at_haptic_rt_${region}_begin OR NOT DEFINED at_haptic_rt_${region}_end)
    set(reason "the program has no region haptic_rt_${region}; link it through haptic_place_rt")
  elseif("${at_${symbol}}" STRLESS "${at_haptic_rt_${region}_begin}" OR
      NOT "${at_${symbol}}" STRLESS "${at_haptic_rt_${region}_end}")
    set(reason "lies outside .rt_${region}")
  else()
    return()
  endif()
  set(violations "${violations}  ${symbol}: ${reason}\n" PARENT_SCOPE)
endfunction()

# Only global and weak functions: local names of two files may be equal.
nm_lines(lines --extern-only ${ARCHIVE})
foreach(line IN LISTS lines)
  if(line MATCHES "^([^ ]+) [TW] ")
    # An image holds what it reaches of its core, other programs all of it.
    if(DEFINED at_${CMAKE_MATCH_1})
      inside(${CMAKE_MATCH_1} text)
      math(EXPR count "${count} + 1")
    endif()
  endif()
endforeach()
if(count EQUAL 0)
  message(FATAL_ERROR "placement: no function of ${ARCHIVE} is in ${PROGRAM}")
endif()
foreach(symbol haptic_rt_scene_begin rt_scene_blob)
  inside(${symbol} const)
endforeach()
if(violations)
  message(FATAL_ERROR "placement: ${PROGRAM}\n${violations}")
endif()
message("placement: ${count} functions of the core lie inside .rt_text")
