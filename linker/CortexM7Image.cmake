# SPDX-License-Identifier: Apache-2.0
# Images of the core for a Cortex-M7, one for each scene.
#   haptic_add_cortex_m7_image(<name> <scene.toml>)
# The scene is compiled on this machine, by a graph_compiler of the same HAPTIC_REAL.
include_guard(GLOBAL)
include(${CMAKE_CURRENT_LIST_DIR}/RtPlacement.cmake)

set(HAPTIC_IMAGE_SCENES ${PROJECT_SOURCE_DIR}/host_sim/scenes/square_peg_five/scene.toml CACHE STRING
  "Scenes (TOML) of which an image is made; named after their folders")
set(HAPTIC_IMAGE_STATE_BYTES 393216 CACHE STRING "Memory that an image keeps for the core [bytes]")
set(host_build release)
if(HAPTIC_REAL STREQUAL "float")
  set(host_build release-float)
endif()
find_program(HAPTIC_GRAPH_COMPILER graph_compiler PATHS ${PROJECT_SOURCE_DIR}/build/${host_build}/bin NO_DEFAULT_PATH
  DOC "graph_compiler of this machine, built with the same HAPTIC_REAL")
if(NOT HAPTIC_GRAPH_COMPILER)
  message(FATAL_ERROR "no graph_compiler for HAPTIC_REAL=${HAPTIC_REAL}: build it first (cmake --preset ${host_build}; "
    "cmake --build --preset ${host_build} --target graph_compiler) or give -DHAPTIC_GRAPH_COMPILER=<program>")
endif()

add_library(haptic_cortex_m7 OBJECT ${haptic_linker_dir}/cortex_m7_image.cpp ${haptic_linker_dir}/cortex_m_start.cpp
  ${haptic_linker_dir}/pose_drive.cpp ${haptic_linker_dir}/semihosting.cpp)
target_link_libraries(haptic_cortex_m7 PUBLIC haptic::rt_core PRIVATE haptic_warnings)
target_include_directories(haptic_cortex_m7 PRIVATE ${PROJECT_SOURCE_DIR})
target_compile_definitions(haptic_cortex_m7 PRIVATE HAPTIC_IMAGE_STATE_BYTES=${HAPTIC_IMAGE_STATE_BYTES})
target_compile_options(haptic_cortex_m7 PRIVATE -fno-exceptions -fno-rtti -fno-threadsafe-statics -fno-math-errno
  -fno-asynchronous-unwind-tables -ffunction-sections -fdata-sections)

function(haptic_add_cortex_m7_image name scene)
  set(blob ${CMAKE_CURRENT_BINARY_DIR}/${name}.rtscene)
  cmake_path(GET scene PARENT_PATH folder)
  file(GLOB parts ${folder}/*)
  add_custom_command(OUTPUT ${blob} COMMAND ${HAPTIC_GRAPH_COMPILER} ${scene} -o ${blob} --quiet
    DEPENDS ${parts} ${HAPTIC_GRAPH_COMPILER} COMMENT "Compiling ${scene}" VERBATIM)
  add_executable(${name} $<TARGET_OBJECTS:haptic_cortex_m7>)
  target_link_libraries(${name} PRIVATE haptic::rt_core)
  set_target_properties(${name} PROPERTIES SUFFIX .elf)
  # No start-up code, no C++ library: of newlib the four functions of memory, of libgcc 64-bit integers.
  target_link_options(${name} PRIVATE -nostdlib -Wl,-T,${haptic_linker_dir}/cortex_m7.ld
    -Wl,--defsym=haptic_stack_bytes=${HAPTIC_RT_STACK_BYTES} -Wl,--orphan-handling=error -Wl,--gc-sections
    -Wl,--print-memory-usage -Wl,--build-id=none -Wl,-z,noexecstack -Wl,--no-warn-rwx-segments
    -Wl,-Map=$<TARGET_FILE:${name}>.map)
  target_link_libraries(${name} PRIVATE -lc -lgcc)
  set_property(TARGET ${name} APPEND PROPERTY LINK_DEPENDS ${haptic_linker_dir}/cortex_m7.ld)
  haptic_embed_scene(${name} ${blob})
endfunction()

foreach(scene ${HAPTIC_IMAGE_SCENES})
  cmake_path(ABSOLUTE_PATH scene BASE_DIRECTORY ${PROJECT_SOURCE_DIR} NORMALIZE)
  cmake_path(GET scene PARENT_PATH folder)
  cmake_path(GET folder FILENAME folder)
  haptic_add_cortex_m7_image(core_image_${folder} ${scene})
endforeach()
