# SPDX-License-Identifier: Apache-2.0
# Rule: the core's text has no dynamic Eigen type and no name of the library that allocates, locks or throws. The symbol
# check sees what was compiled; this one also sees templates that nothing has used yet.
# cmake -DROOT=<project> -P core_words.cmake
include(${CMAKE_CURRENT_LIST_DIR}/source_tree.cmake)

set(words
  "Eigen::Dynamic" "(Matrix|Vector|RowVector|Array)X+[0-9]?[a-z]*" "Matrix[0-9]X[a-z]*" "Eigen/Dense"
  "std::(vector|string|deque|list|map|set|unordered_map|unordered_set|function|any|regex)"
  "std::(unique_ptr|shared_ptr|make_unique|make_shared|allocator|pmr)"
  "std::(mutex|thread|jthread|condition_variable|lock_guard|unique_lock|scoped_lock|future|async)"
  "std::(cout|cerr|printf|ostream|istream|to_string|chrono)"
  "throw" "catch" "dynamic_cast" "typeid" "thread_local" "(alloca|malloc|calloc|realloc)")

haptic_source_files(files "\\.(hpp|cpp)$" rt_core)
foreach(path IN LISTS files)
  file(READ ${ROOT}/${path} content)
  # Comments may name what the code must not.
  string(REGEX REPLACE "//[^\n]*" "" content "${content}")
  foreach(word IN LISTS words)
    if("${content}" MATCHES "(^|[^A-Za-z0-9_])(${word})($|[^A-Za-z0-9_])")
      set(found "${CMAKE_MATCH_2}")
      haptic_violation("${path}: '${found}' does not belong in the core; use fixed sizes, spans and status values")
    endif()
  endforeach()
endforeach()
list(LENGTH files count)
haptic_report("words of the core" ${count})
