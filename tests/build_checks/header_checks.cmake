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
