# SPDX-License-Identifier: Apache-2.0
# Rules about what `cmake --install` places.
set(installed ${CMAKE_COMMAND} -DBUILD=${PROJECT_BINARY_DIR} -DSOURCE=${PROJECT_SOURCE_DIR}
  -DCOMPILER=${CMAKE_CXX_COMPILER} -DLAUNCHER=${CMAKE_CXX_COMPILER_LAUNCHER} -DVERSION=${PROJECT_VERSION}
  -DREAL=${HAPTIC_REAL} -DARCH=${HAPTIC_RT_ARCH})
# With a sanitizer a user's program would have to be built with the same.
if(HAPTIC_BUILD_TOOLS AND HAPTIC_INSTALL AND NOT CMAKE_CXX_FLAGS MATCHES "-fsanitize")
  haptic_build_check(installed ${installed} -DFOLDER=${samples}/installed -P ${checks}/installed.cmake)
  set_tests_properties(build_checks.installed PROPERTIES TIMEOUT 900)
  haptic_build_probe(installed.probe_header "includes 'rt_core/base/pose.hpp', which is not installed" ${installed}
    -DFOLDER=${samples}/installed_header -DREMOVE=include/haptic/rt_core/base/pose.hpp -P ${checks}/installed.cmake)
  haptic_build_probe(installed.probe_component "the component 'hal' of haptic is not installed" ${installed}
    -DFOLDER=${samples}/installed_component "-DCOMPONENTS=core|tools" -P ${checks}/installed.cmake)
  haptic_build_probe(installed.probe_version "the version found is not 0.0.1" ${installed} -DVERSION=0.0.1
    -DFOLDER=${samples}/installed_version -P ${checks}/installed.cmake)
endif()
