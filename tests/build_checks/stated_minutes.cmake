# SPDX-License-Identifier: Apache-2.0
# Rule: the minutes that the README states are those that the commands say at their start (tools/common/minutes.txt), and the
# commands say at their end what they took.
# cmake -DROOT=<project> -DREADME=<file> -P stated_minutes.cmake
cmake_minimum_required(VERSION 3.25)

file(READ ${README} readme)
file(STRINGS ${ROOT}/tools/common/minutes.txt lines)
set(count 0)
foreach(line IN LISTS lines)
  if(NOT line MATCHES "^([a-z_]+) ([0-9]+)$")
    message(FATAL_ERROR "tools/common/minutes.txt: '${line}' is not 'NAME MINUTES'")
  endif()
  set(name ${CMAKE_MATCH_1})
  set(minutes ${CMAKE_MATCH_2})
  set(pattern "tools/${name} +# about ([0-9]+) min")
  if(name STREQUAL "check_all")
    set(pattern "`tools/check --all` adds[^()]*\\(about ([0-9]+) min\\)")
  endif()
  if(NOT readme MATCHES "${pattern}")
    message(FATAL_ERROR "${README}: does not state the minutes of ${name}: ${pattern}")
  endif()
  if(NOT CMAKE_MATCH_1 EQUAL minutes)
    message(FATAL_ERROR "${README}: says ${CMAKE_MATCH_1} min for ${name}, and tools/common/minutes.txt says ${minutes}")
  endif()
  math(EXPR count "${count} + 1")
endforeach()

execute_process(COMMAND bash -ec "source tools/common/steps.sh; minutes quickstart; awk 'BEGIN { for (k = 0; k < 3e7; ++k) s += k }'; took" WORKING_DIRECTORY ${ROOT}
  OUTPUT_VARIABLE said COMMAND_ERROR_IS_FATAL ANY)
if(NOT said MATCHES "This takes about [0-9]+\\.[05] minutes on [0-9]+ cores.*This took [0-9]+\\.[0-9] minutes \\([0-9.]+ of them for packages\\) and [1-9][0-9]* CPU seconds\\.")
  message(FATAL_ERROR "tools/common/steps.sh: says of the time: ${said}")
endif()
message("stated minutes: ${count} figures are those of the README")
