# SPDX-License-Identifier: Apache-2.0
# Debian packages, one for each component: cpack -G DEB --config <build>/CPackConfig.cmake. They lie below /usr.
set(contact "haptic maintainers <maintainers@users.noreply.github.com>")
set(doc_folder share/doc)

# The newest entry of the change log is this version's; its date is the packages'.
set(change_log ${PROJECT_SOURCE_DIR}/.github/CHANGELOG.md)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${change_log})
file(STRINGS ${change_log} heads REGEX "^## ")
list(GET heads 0 head)
if(NOT head MATCHES "^## ([0-9.]+), ([0-9-]+)$" OR NOT CMAKE_MATCH_1 STREQUAL PROJECT_VERSION)
  message(FATAL_ERROR "${change_log}: the newest entry is '${head}'; it must be '## ${PROJECT_VERSION}, YYYY-MM-DD', the "
    "version of project() in ${PROJECT_SOURCE_DIR}/CMakeLists.txt")
endif()
execute_process(COMMAND date --utc --rfc-email --date=${CMAKE_MATCH_2} OUTPUT_VARIABLE date
  OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
file(WRITE ${CMAKE_CURRENT_BINARY_DIR}/changelog "\
haptic (${PROJECT_VERSION}) unstable; urgency=medium

  * Changes of this version: .github/CHANGELOG.md of the source.

 -- ${contact}  ${date}
")
find_program(HAPTIC_GZIP gzip REQUIRED)
mark_as_advanced(HAPTIC_GZIP)
execute_process(COMMAND ${HAPTIC_GZIP} -9nkf ${CMAKE_CURRENT_BINARY_DIR}/changelog COMMAND_ERROR_IS_FATAL ANY)

set(CPACK_PACKAGE_NAME haptic)
set(CPACK_PACKAGE_CONTACT "${contact}")
set(CPACK_PACKAGE_VENDOR "haptic")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")  # each package has its own; one for all would be put before it
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
  OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)

# haptic_package(<component> <name> <section> <summary> <description> [DEPENDS ..] [RECOMMENDS ..] [SUGGESTS ..] [CONTROL ..]
#                [ANY_MACHINE])
function(haptic_package component name section summary description)
  cmake_parse_arguments(PARSE_ARGV 5 given "ANY_MACHINE" "DEPENDS;RECOMMENDS;SUGGESTS" "CONTROL")
  string(TOUPPER ${component} key)
  set(CPACK_COMPONENTS_ALL ${CPACK_COMPONENTS_ALL} ${component} PARENT_SCOPE)
  set(CPACK_DEBIAN_${key}_PACKAGE_NAME ${name} PARENT_SCOPE)
  set(CPACK_DEBIAN_${key}_PACKAGE_SECTION ${section} PARENT_SCOPE)
  set(CPACK_DEBIAN_${key}_DESCRIPTION "${summary}\n${description}" PARENT_SCOPE)
  set(CPACK_DEBIAN_${key}_PACKAGE_DEPENDS "${given_DEPENDS}" PARENT_SCOPE)
  set(CPACK_DEBIAN_${key}_PACKAGE_RECOMMENDS "${given_RECOMMENDS}" PARENT_SCOPE)
  set(CPACK_DEBIAN_${key}_PACKAGE_SUGGESTS "${given_SUGGESTS}" PARENT_SCOPE)
  set(CPACK_DEBIAN_${key}_PACKAGE_CONTROL_EXTRA "${given_CONTROL}" PARENT_SCOPE)
  if(given_ANY_MACHINE)
    set(CPACK_DEBIAN_${key}_PACKAGE_ARCHITECTURE all PARENT_SCOPE)
  endif()
  install(FILES ${CMAKE_CURRENT_SOURCE_DIR}/debian/copyright ${CMAKE_CURRENT_BINARY_DIR}/changelog.gz
    DESTINATION ${doc_folder}/${name} COMPONENT ${component})
endfunction()

set(same "(= ${PROJECT_VERSION})")
set(CPACK_COMPONENTS_ALL)
haptic_package(core libhaptic-core-dev libdevel "6-DOF haptic rendering of contact: the real-time core"
  "C++20 headers and an archive: a tick of bounded work without heap or locks.\nFound by find_package(haptic COMPONENTS core)."
  DEPENDS "libeigen3-dev (>= 3.4)")
haptic_package(hal libhaptic-hal-dev libdevel "6-DOF haptic rendering of contact: drivers of devices"
  "C++20 headers and an archive: drivers, link, output guard and servo loop.\nFound by find_package(haptic COMPONENTS core hal)."
  DEPENDS "libhaptic-core-dev ${same}, libusb-1.0-0-dev, pkg-config")
haptic_package(library libhaptic0 libs "6-DOF haptic rendering of contact: the C interface"
  "Meshes to a compiled scene, the tick, and a servo loop in a thread of\nthe library."
  CONTROL ${CMAKE_CURRENT_SOURCE_DIR}/debian/library/triggers)
haptic_package(dev libhaptic-dev libdevel "6-DOF haptic rendering of contact: header of the C interface"
  "haptic.h (C99), for pkg-config and find_package(haptic COMPONENTS library)."
  DEPENDS "libhaptic0 ${same}, libhaptic-core-dev ${same}")
haptic_package(tools haptic-tools science "6-DOF haptic rendering of contact: the programs"
  "graph_compiler compiles meshes, scene_inspect explains a scene, host_sim\nreplays motions, run_device drives a device; with rules for udev and a\nservice."
  SUGGESTS "systemd"
  CONTROL ${CMAKE_CURRENT_SOURCE_DIR}/debian/tools/postinst ${CMAKE_CURRENT_SOURCE_DIR}/debian/tools/postrm)
haptic_package(lab haptic-lab science "6-DOF haptic rendering of contact: the laboratory"
  "host_lab verifies the core, times it and compares it with other methods."
  DEPENDS "haptic-tools ${same}")
haptic_package(python python3-haptic python "6-DOF haptic rendering of contact: Python package"
  "import haptic: compile meshes, replay motions, run a servo loop; over\nlibhaptic0."
  DEPENDS "python3 (>= 3.9), python3-numpy, libhaptic0 (>= ${PROJECT_VERSION})" RECOMMENDS "python3-matplotlib"
  CONTROL ${CMAKE_CURRENT_SOURCE_DIR}/debian/python/postinst ${CMAKE_CURRENT_SOURCE_DIR}/debian/python/prerm
  ANY_MACHINE)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SHLIBDEPS OFF)
foreach(component CORE HAL DEV)
  set(CPACK_DEBIAN_${component}_PACKAGE_SHLIBDEPS OFF)
endforeach()
include(CPack)
