# SPDX-License-Identifier: Apache-2.0
# Rule: a tick's account of its work is written by addition, or as the largest of its kind: nothing takes work back or
# overwrites it, so a budget that is read from it holds.
# cmake -DROOT=<project> -P work_account.cmake
include(${CMAKE_CURRENT_LIST_DIR}/source_tree.cmake)

haptic_source_files(files "\\.(hpp|cpp)$" rt_core/proxy)
foreach(path IN LISTS files)
  file(READ ${ROOT}/${path} content)
  string(REGEX REPLACE "//[^\n]*" "" content "${content}")
  string(REGEX MATCHALL "work\\.[a-z_]+[ \n]*(=[^=;][^;]*|[-*/|&]=[^;]*|--)" writes "${content}")
  foreach(write IN LISTS writes)
    string(REGEX REPLACE "^work\\.([a-z_]+).*" "\\1" name "${write}")
    if(NOT write MATCHES "= std::max\\([a-z_]+\\.work\\.${name},")
      string(REGEX REPLACE "[ \n]+" " " write "${write}")
      haptic_line_of(line ${path} "work.${name}")
      haptic_violation("${path}:${line}: '${write}' overwrites the account; add to it, or take the larger of the two")
    endif()
  endforeach()
endforeach()
list(LENGTH files count)
haptic_report("account of a tick" ${count})
