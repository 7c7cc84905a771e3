# SPDX-License-Identifier: Apache-2.0
# Collision libraries that `host_sim pareto` measures next to the core, and the physics engine of `host_sim bodies`: each adapter is built where its
# library is found, and nothing else depends on any of them.
set(HAPTIC_PEERS AUTO CACHE STRING
  "Foreign libraries in `host_sim pareto` and `host_sim bodies`: AUTO (those that are found) or OFF")
set_property(CACHE HAPTIC_PEERS PROPERTY STRINGS AUTO OFF)
if(NOT HAPTIC_PEERS MATCHES "^(AUTO|OFF)$")
  message(FATAL_ERROR "HAPTIC_PEERS is '${HAPTIC_PEERS}'; use 'AUTO' or 'OFF'")
endif()

# haptic_foreign_adapter(<NAME> <source> <include folders> <flags> <libraries>): object library of one adapter. It sees
# none of the core's flags, so it is compiled as the library's own programs are.
set(haptic_foreign_found)
function(haptic_foreign_adapter name source includes flags)
  string(TOLOWER haptic_peer_${name} target)
  add_library(${target} OBJECT ${source})
  target_include_directories(${target} PRIVATE ${PROJECT_SOURCE_DIR})
  target_include_directories(${target} SYSTEM PRIVATE ${includes})
  target_compile_options(${target} PRIVATE ${flags})
  target_link_libraries(${target} PRIVATE haptic_warnings)
  # Their headers' templates and macros are judged by their makers.
  target_compile_options(${target} PRIVATE -Wno-old-style-cast -Wno-uninitialized -Wno-conversion
    -Wno-sign-conversion -Wno-undef -Wno-double-promotion)
  target_sources(haptic_host_lab PRIVATE $<TARGET_OBJECTS:${target}>)
  target_link_libraries(haptic_host_lab PRIVATE ${ARGN})
endfunction()

# haptic_foreign_peer(<NAME> <pkg-config module> <source> <libraries>): where pkg-config finds the library.
function(haptic_foreign_peer name module source)
  set(found 0)
  set(version "")
  if(HAPTIC_PEERS STREQUAL "AUTO" AND PkgConfig_FOUND)
    pkg_check_modules(HAPTIC_PEER_${name} QUIET IMPORTED_TARGET ${module})
    if(HAPTIC_PEER_${name}_FOUND)
      set(found 1)
      set(version "${HAPTIC_PEER_${name}_VERSION}")
      set(flags ${HAPTIC_PEER_${name}_CFLAGS_OTHER})
      list(FILTER flags EXCLUDE REGEX "^-std=")
      haptic_foreign_adapter(${name} ${source} "${HAPTIC_PEER_${name}_INCLUDE_DIRS}" "${flags}" ${ARGN})
      set(haptic_foreign_found ${haptic_foreign_found} "${name} ${version}" PARENT_SCOPE)
    endif()
  endif()
  set_property(SOURCE lab/peers/peer_catalog.cpp APPEND PROPERTY COMPILE_DEFINITIONS
    HAPTIC_PEER_${name}=${found} "HAPTIC_PEER_${name}_VERSION=\"${version}\"")
endfunction()

if(HAPTIC_PEERS STREQUAL "AUTO")
  find_package(PkgConfig QUIET)
endif()
haptic_foreign_peer(CCD ccd lab/peers/ccd_peer.cpp ccd)
haptic_foreign_peer(FCL fcl lab/peers/fcl_peer.cpp fcl ccd)
if(TARGET haptic_peer_fcl)
  # FCL's own objects hold Eigen's types, aligned as its makers built it; the project builds Eigen without alignment.
  target_compile_definitions(haptic_peer_fcl PRIVATE EIGEN_MAX_STATIC_ALIGN_BYTES=16 EIGEN_MAX_ALIGN_BYTES=16)
endif()
haptic_foreign_peer(BULLET bullet-float64 lab/peers/bullet_peer.cpp
  BulletCollision-float64 LinearMath-float64)
haptic_foreign_peer(ODE ode lab/peers/ode_peer.cpp ode)

# MuJoCo, which `host_sim bodies` steps next to the law of several bodies, and `host_sim pareto` as a coupled part. Debian's has no file for pkg-config.
set(haptic_mujoco_found 0)
if(HAPTIC_PEERS STREQUAL "AUTO")
  find_path(HAPTIC_MUJOCO_INCLUDE mujoco/mujoco.h)
  find_library(HAPTIC_MUJOCO_LIBRARY mujoco)
  mark_as_advanced(HAPTIC_MUJOCO_INCLUDE HAPTIC_MUJOCO_LIBRARY)
  if(HAPTIC_MUJOCO_INCLUDE AND HAPTIC_MUJOCO_LIBRARY)
    set(haptic_mujoco_found 1)
    haptic_foreign_adapter(MUJOCO "lab/peers/mujoco_bodies.cpp;lab/peers/mujoco_coupled.cpp" "${HAPTIC_MUJOCO_INCLUDE}" "" ${HAPTIC_MUJOCO_LIBRARY})
    list(APPEND haptic_foreign_found MUJOCO)
  endif()
endif()
set_property(SOURCE lab/bodies_study/peer_run.cpp lab/pareto/opponents.cpp APPEND PROPERTY COMPILE_DEFINITIONS
  HAPTIC_PEER_MUJOCO=${haptic_mujoco_found})
message(STATUS "Libraries measured next to the core: ${haptic_foreign_found}")
