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
  set_tests_properties(build_checks.installed PROPERTIES TIMEOUT 900 COST 30)
  haptic_build_probe(installed.probe_header "includes 'rt_core/base/pose.hpp', which is not installed" ${installed}
    -DFOLDER=${samples}/installed_header -DREMOVE=include/haptic/rt_core/base/pose.hpp -P ${checks}/installed.cmake)
  haptic_build_probe(installed.probe_component "the component 'hal' of haptic is not installed" ${installed}
    -DFOLDER=${samples}/installed_component "-DCOMPONENTS=core|tools" -P ${checks}/installed.cmake)
  haptic_build_probe(installed.probe_not_built "Build it first: cmake --build " ${CMAKE_COMMAND} -DSOURCE=${PROJECT_SOURCE_DIR}
    -DCOMPILER=${CMAKE_CXX_COMPILER} -DFOLDER=${samples}/installed_not_built -P ${checks}/install_not_built.cmake)
  haptic_build_probe(installed.probe_version "the version found is not 0.0.1" ${installed} -DVERSION=0.0.1
    -DFOLDER=${samples}/installed_version -P ${checks}/installed.cmake)
  # A minute of compiling what a user would.
  haptic_all_checks(build_checks.installed build_checks.installed.probe_header build_checks.installed.probe_component
    build_checks.installed.probe_not_built build_checks.installed.probe_version)
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

  find_program(HAPTIC_ABIDIFF abidiff)
  mark_as_advanced(HAPTIC_ABIDIFF)
  set(interface ${CMAKE_COMMAND} -DHEADER=${PROJECT_SOURCE_DIR}/tools/library/haptic.h
    -DMAP=${PROJECT_SOURCE_DIR}/tools/library/haptic.map -DC_COMPILER=${HAPTIC_CC} -DABIDIFF=${HAPTIC_ABIDIFF}
    -DREFERENCE=${PROJECT_SOURCE_DIR}/tools/library/interface_0.abi)
  haptic_build_check(interface ${interface} -DFOLDER=${samples}/interface -P ${checks}/interface.cmake)
  if(HAPTIC_ABIDIFF)
    haptic_build_probe(interface.probe_structure "'double gap_m' offset changed from 896 to 960" ${interface}
      -DFOLDER=${samples}/interface_structure "-DFROM=double felt_pose[7]" "-DTO=double felt_pose[8]"
      -P ${checks}/interface.cmake)
    haptic_build_probe(interface.probe_number "'haptic_hold::HAPTIC_HOLD' from value '1' to '3'" ${interface}
      -DFOLDER=${samples}/interface_number "-DFROM=HAPTIC_HOLD = 1" "-DTO=HAPTIC_HOLD = 3"
      -P ${checks}/interface.cmake)
  endif()
endif()

if(HAPTIC_BUILD_TOOLS AND HAPTIC_INSTALL AND NOT CMAKE_CXX_FLAGS MATCHES "-fsanitize")
  find_program(HAPTIC_BASH bash)
  find_program(HAPTIC_DPKG_DEB dpkg-deb)
  find_program(HAPTIC_LINTIAN lintian)
  mark_as_advanced(HAPTIC_BASH HAPTIC_DPKG_DEB HAPTIC_LINTIAN)
  set(pages ${PROJECT_BINARY_DIR}/tools/package)
  if(HAPTIC_BASH)
    set(graph_compiler_also -DALSO=init)
    foreach(program graph_compiler scene_inspect run_device device_bridge host_sim host_lab)
      haptic_build_check(program_pages.${program} ${CMAKE_COMMAND} -DPROGRAM=$<TARGET_FILE:${program}> -DPAGES=${pages}
        -DBASH=${HAPTIC_BASH} ${${program}_also} -P ${checks}/program_pages.cmake)
    endforeach()
    # A page and a completion that lack all but one option.
    file(WRITE ${samples}/few_pages/man/scene_inspect.1 ".B -h,--help\n")
    file(WRITE ${samples}/few_pages/completions/scene_inspect "_scene_inspect() { COMPREPLY=(-h --help); }\n")
    set(few ${CMAKE_COMMAND} -DPROGRAM=$<TARGET_FILE:scene_inspect> -DPAGES=${samples}/few_pages -DBASH=${HAPTIC_BASH}
      -P ${checks}/program_pages.cmake)
    haptic_build_probe(program_pages.probe_page "man scene_inspect: lacks '--json'" ${few})
    haptic_build_probe(program_pages.probe_completion "completion of scene_inspect : lacks --json" ${few})
  endif()
  # Made once; the probes look at the same ones.
  set(packages ${CMAKE_COMMAND} -DBUILD=${PROJECT_BINARY_DIR} -DCPACK=${CMAKE_CPACK_COMMAND}
    -DDPKG_DEB=${HAPTIC_DPKG_DEB} -DFOLDER=${samples}/packages -DNEEDS=libc6)
  haptic_build_check(packages ${packages} -DLINTIAN=${HAPTIC_LINTIAN} -DVERSION=${PROJECT_VERSION}
    -P ${checks}/packages.cmake)
  set_tests_properties(build_checks.packages PROPERTIES TIMEOUT 600 FIXTURES_SETUP packages)
  haptic_all_checks(build_checks.packages)  # a minute of packing
  if(HAPTIC_DPKG_DEB)
    haptic_build_probe(packages.probe_file "haptic-tools: lacks /usr/bin/host_lab" ${packages} -DMADE=ON
      -DVERSION=${PROJECT_VERSION} -DLACKS=bin/host_lab -P ${checks}/packages.cmake)
    haptic_build_probe(packages.probe_version "there is no package libhaptic0 of version 0.0.1" ${packages} -DMADE=ON
      -DVERSION=0.0.1 -P ${checks}/packages.cmake)
    haptic_build_probe(packages.probe_depends "haptic-tools: does not depend on libhaptic-nothing" ${packages} -DMADE=ON
      -DVERSION=${PROJECT_VERSION} -DNEEDS=libhaptic-nothing -P ${checks}/packages.cmake)
    haptic_build_probe(packages.probe_script "haptic-tools: lacks the script preinst" ${packages} -DMADE=ON
      -DVERSION=${PROJECT_VERSION} -DLACKS_SCRIPT=preinst -P ${checks}/packages.cmake)
    set_tests_properties(build_checks.packages.probe_depends build_checks.packages.probe_file
      build_checks.packages.probe_script build_checks.packages.probe_version PROPERTIES FIXTURES_REQUIRED packages RESOURCE_LOCK packages)
    haptic_all_checks(build_checks.packages.probe_depends build_checks.packages.probe_file
      build_checks.packages.probe_script build_checks.packages.probe_version)
  endif()
endif()
