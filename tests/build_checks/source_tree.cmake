# SPDX-License-Identifier: Apache-2.0
# What the source rules share: the list of source files below ROOT and a line reader that survives brackets and
# semicolons, which CMake lists do not.
cmake_minimum_required(VERSION 3.25)

if(NOT DEFINED ROOT)
  message(FATAL_ERROR "pass -DROOT=<folder of the project>")
endif()
set(haptic_folders rt_core hal tools host_sim tests linker)

# Source files below the given folders of ROOT whose names match `pattern`, relative to ROOT, sorted.
function(haptic_source_files out pattern)
  set(found)
  foreach(folder IN LISTS ARGN)
    file(GLOB_RECURSE files LIST_DIRECTORIES false RELATIVE ${ROOT} ${ROOT}/${folder}/*)
    list(FILTER files INCLUDE REGEX "${pattern}")
    list(APPEND found ${files})
  endforeach()
  list(SORT found)
  set(${out} ${found} PARENT_SCOPE)
endfunction()

# Number of the first line of `path` that contains `text`, for messages.
function(haptic_line_of out path text)
  file(READ ${ROOT}/${path} content)
  string(FIND "${content}" "${text}" at)
  string(SUBSTRING "${content}" 0 ${at} before)
  string(REGEX REPLACE "[^\n]" "" newlines "${before}")
  string(LENGTH "${newlines}" count)
  math(EXPR count "${count} + 1")
  set(${out} ${count} PARENT_SCOPE)
endfunction()

# Collects one violation; haptic_report ends the script with all of them.
function(haptic_violation text)
  set_property(GLOBAL APPEND_STRING PROPERTY haptic_violations "  ${text}\n")
endfunction()

function(haptic_report rule checked)
  get_property(violations GLOBAL PROPERTY haptic_violations)
  if(violations)
    message(FATAL_ERROR "${rule}:\n${violations}")
  endif()
  if(checked EQUAL 0)
    message(FATAL_ERROR "${rule}: nothing to check below ${ROOT}")
  endif()
  message("${rule}: ${checked} files keep the rule")
endfunction()
