# SPDX-License-Identifier: Apache-2.0
# Rule: the library exports what its header declares, and that is what the list of this version of the interface says.
# cmake -DLIBRARY=<libhaptic.so> -DNM=<nm> -DHEADER=<haptic.h> -DLIST=<symbols_0.txt> -P exported_symbols.cmake
cmake_minimum_required(VERSION 3.25)

file(STRINGS ${LIST} listed REGEX "^haptic_")
file(READ ${HEADER} text)
string(REGEX MATCHALL "\nHAPTIC_API [^;(]*\\(" declarations "${text}")
set(declared)
foreach(declaration IN LISTS declarations)
  string(REGEX REPLACE ".*[ *](haptic_[a-z0-9_]+)\\($" "\\1" name "${declaration}")
  list(APPEND declared ${name})
endforeach()
execute_process(COMMAND ${NM} -D --defined-only --format=posix ${LIBRARY} OUTPUT_VARIABLE output
  COMMAND_ERROR_IS_FATAL ANY)
string(REGEX MATCHALL "[^\n]+" lines "${output}")
set(exported)
foreach(line IN LISTS lines)
  # The node of the version itself is an absolute symbol.
  if(NOT line MATCHES "^([^ @]+)[^ ]* A " AND line MATCHES "^([^ @]+)")
    list(APPEND exported ${CMAKE_MATCH_1})
  endif()
endforeach()

set(violations)
foreach(pair "exported declared" "declared exported" "exported listed" "listed exported")
  separate_arguments(pair)
  list(GET pair 0 first)
  list(GET pair 1 second)
  set(only ${${first}})
  list(REMOVE_ITEM only ${${second}})
  foreach(name IN LISTS only)
    string(APPEND violations "  ${name}: ${first}, but not ${second}\n")
  endforeach()
endforeach()
list(LENGTH exported count)
if(count EQUAL 0)
  string(APPEND violations "  ${LIBRARY} exports nothing\n")
endif()
if(violations)
  message(FATAL_ERROR "exported symbols: ${LIBRARY}, ${HEADER} and ${LIST} differ; a name that was once released stays\n"
    "${violations}")
endif()
message("exported symbols: ${count}")
