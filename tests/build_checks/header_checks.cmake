# SPDX-License-Identifier: Apache-2.0
# Rule: each header of the core and of hal compiles alone. CMake makes one source file per header of a file set; some four
# minutes of work in all.
add_test(NAME build_checks.header_alone
  COMMAND ${CMAKE_COMMAND} --build ${PROJECT_BINARY_DIR} --target all_verify_interface_header_sets)
set_tests_properties(build_checks.header_alone PROPERTIES LABELS build TIMEOUT 600 RESOURCE_LOCK build_tree)

# The probe is a project of its own with the same property, made by the same generator and compiler.
haptic_build_probe(header_alone.probe_missing_include "needs_its_neighbour.hpp"
  ${CMAKE_CTEST_COMMAND} --build-and-test ${checks}/probes/header_alone ${samples}/header_alone
  --build-generator ${CMAKE_GENERATOR} --build-target all_verify_interface_header_sets
  --build-options -DCMAKE_CXX_COMPILER=${CMAKE_CXX_COMPILER})

# Rule: each source compiles alone too. One build of all is enough.
set(source_alone ${CMAKE_COMMAND} -DNINJA=${CMAKE_MAKE_PROGRAM})
if(HAPTIC_BUILD_TOOLS AND CMAKE_BUILD_TYPE STREQUAL Release AND CMAKE_CXX_COMPILER_ID STREQUAL GNU
    AND HAPTIC_REAL STREQUAL double AND NOT HAPTIC_RT_ARCH AND CMAKE_GENERATOR STREQUAL Ninja)
  haptic_build_check(source_alone ${source_alone} -DCOMMANDS=${PROJECT_BINARY_DIR}/compile_commands.json
    -DFOLDER=${PROJECT_BINARY_DIR}/source_alone -P ${checks}/source_alone.cmake)
  set_tests_properties(build_checks.source_alone PROPERTIES TIMEOUT 7200 RESOURCE_LOCK build_tree COST 600)
endif()
if(CMAKE_GENERATOR STREQUAL Ninja)
  set(probe ${samples}/source_alone)
  file(WRITE ${probe}/Unity/unity_0_cxx.cxx "#include \"${checks}/probes/source_alone/first.cpp\"
#include \"${checks}/probes/source_alone/second.cpp\"
")
  file(WRITE ${probe}/commands.json "[
{
  \"directory\": \"${probe}\",
  \"command\": \"${CMAKE_CXX_COMPILER} -O1 -o one.o -c ${probe}/Unity/unity_0_cxx.cxx\",
  \"file\": \"${probe}/Unity/unity_0_cxx.cxx\"
}
]
")
  haptic_build_probe(source_alone.probe_neighbour "second.cpp: does not compile by itself" ${source_alone}
    -DCOMMANDS=${probe}/commands.json -DFOLDER=${probe}/made -P ${checks}/source_alone.cmake)
endif()
