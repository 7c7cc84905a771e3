# SPDX-License-Identifier: Apache-2.0
# Rules about what `cmake --install` places.
find_program(HAPTIC_CC NAMES gcc cc clang REQUIRED)
mark_as_advanced(HAPTIC_CC)
set(installed ${CMAKE_COMMAND} -DBUILD=${PROJECT_BINARY_DIR} -DSOURCE=${PROJECT_SOURCE_DIR}
  -DCOMPILER=${CMAKE_CXX_COMPILER} -DC_COMPILER=${HAPTIC_CC} -DLAUNCHER=${CMAKE_CXX_COMPILER_LAUNCHER} -DVERSION=${PROJECT_VERSION}
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

if(HAPTIC_BUILD_TOOLS)
  set(exported ${CMAKE_COMMAND} -DLIBRARY=$<TARGET_FILE:haptic> -DNM=${HAPTIC_NM}
    -DHEADER=${PROJECT_SOURCE_DIR}/tools/library/haptic.h)
  haptic_build_check(exported_symbols ${exported} -DLIST=${PROJECT_SOURCE_DIR}/tools/library/symbols_0.txt
    -P ${checks}/exported_symbols.cmake)
  file(READ ${PROJECT_SOURCE_DIR}/tools/library/symbols_0.txt names)
  string(REPLACE "haptic_compile\n" "" fewer "${names}")
  file(WRITE ${samples}/fewer_symbols.txt "${fewer}")
  file(WRITE ${samples}/more_symbols.txt "${names}haptic_gone\n")
  haptic_build_probe(exported_symbols.probe_unlisted "haptic_compile: exported, but not listed" ${exported}
    -DLIST=${samples}/fewer_symbols.txt -P ${checks}/exported_symbols.cmake)
  haptic_build_probe(exported_symbols.probe_gone "haptic_gone: listed, but not exported" ${exported}
    -DLIST=${samples}/more_symbols.txt -P ${checks}/exported_symbols.cmake)
endif()
