# SPDX-License-Identifier: Apache-2.0
# Rule: every source file starts with its licence line (a script may have its interpreter line before it).
# cmake -DROOT=<project> -P licence_line.cmake
include(${CMAKE_CURRENT_LIST_DIR}/source_tree.cmake)

haptic_source_files(files "\\.(hpp|cpp|h|c|S|in|inc|ld|cmake|py|sh|mjs|ts|css)$|CMakeLists\\.txt$" ${haptic_folders})
foreach(path CMakeLists.txt .ci/run tools/quickstart tools/check tools/view)
  if(EXISTS ${ROOT}/${path})
    list(APPEND files ${path})
  endif()
endforeach()
foreach(path IN LISTS files)
  file(STRINGS ${ROOT}/${path} lines LIMIT_COUNT 2)
  list(POP_FRONT lines first second)
  if(first MATCHES "^#!")
    set(first "${second}")
  endif()
  if(NOT first MATCHES "^(//|#|/\\*) SPDX-License-Identifier: Apache-2\\.0( \\*/)?$")
    haptic_violation("${path}:1: first line is not '// SPDX-License-Identifier: Apache-2.0' (# or /* */ by language)")
  endif()
endforeach()
list(LENGTH files count)
haptic_report("licence line" ${count})
