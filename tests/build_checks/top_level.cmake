# SPDX-License-Identifier: Apache-2.0
# Rule: the top level holds the six folders and four files, dot-files, and what .gitignore names (build/, out/).
# cmake -DROOT=<project> -P top_level.cmake
include(${CMAKE_CURRENT_LIST_DIR}/source_tree.cmake)

set(known CMakeLists.txt CMakePresets.json LICENSE README.md build out ${haptic_folders})
file(GLOB entries RELATIVE ${ROOT} ${ROOT}/*)
list(FILTER entries EXCLUDE REGEX "^\\.")
foreach(entry IN LISTS entries)
  if(NOT entry IN_LIST known)
    haptic_violation("${entry}: not at the top level; put it into one of ${haptic_folders}")
  endif()
endforeach()
list(LENGTH entries count)
haptic_report("top level" ${count})
