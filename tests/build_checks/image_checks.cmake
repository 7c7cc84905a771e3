# SPDX-License-Identifier: Apache-2.0
# Images of scenes of the project (linker/SceneImage.cmake): the tetrahedron's, without operating system. Each image is one
# more core to compile; with HAPTIC_ALL_CHECKS those of more_images.cmake too. Each must compute the bits of the general
# program along the scene's motion, and stop at any other scene.

set(skip_image "${skip_link}")
if(NOT skip_image AND NOT TARGET graph_compiler)
  set(skip_image "this build has no graph compiler")
endif()
if(skip_image)
  foreach(name image_bits image_placement image_budget)
    haptic_image_check(${name} ${CMAKE_COMMAND} -E echo "skipped: ${skip_image}")
  endforeach()
  return()
endif()

add_executable(motion_ticks motion_ticks.cpp)
target_link_libraries(motion_ticks PRIVATE haptic::host_sim haptic_warnings)
set_target_properties(motion_ticks PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/tests)

# haptic_motion_ticks(<name> <script or csv>): <name>.ticks in this folder.
function(haptic_motion_ticks name motion)
  add_custom_command(OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/${name}.ticks
    COMMAND motion_ticks ${motion} ${CMAKE_CURRENT_BINARY_DIR}/${name}.ticks DEPENDS motion_ticks ${motion} VERBATIM)
endfunction()

# haptic_general_program(<name> <scene> <state bytes> <motion>): what an image is compared with.
function(haptic_general_program name scene state motion)
  add_executable(${name})
  target_link_libraries(${name} PRIVATE haptic_hosted_run)
  haptic_place_rt(${name})
  haptic_embed_scene(${name} ${scene})
  haptic_embed_state(${name} ${state})
  haptic_embed_motion(${name} ${motion})
endfunction()

set(scenes ${PROJECT_SOURCE_DIR}/host_sim/scenes)

# A device that only translates, with all that stands between law and device.
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${scenes}/tetrahedron_fixed/scene.toml)
file(READ ${scenes}/tetrahedron_fixed/scene.toml text)
string(REPLACE "mesh = \"" "mesh = \"${scenes}/tetrahedron_fixed/" text "${text}")
set(device_scene ${CMAKE_CURRENT_BINARY_DIR}/tetrahedron_device/scene.toml)
file(CONFIGURE OUTPUT ${device_scene} @ONLY
  CONTENT "${text}\n[device]\nmass_kg = 0.2\ndamping_ns_per_m = 5.0\nencoder_step_m = 1e-5\n")

set(images ${CMAKE_CURRENT_BINARY_DIR})
haptic_motion_ticks(tetrahedron ${scenes}/tetrahedron_on_box/motion.toml)
haptic_add_scene_image(image_tetrahedron FREESTANDING SCENE ${scenes}/tetrahedron_on_box/scene.toml
  MOTION ${images}/tetrahedron.ticks BUDGET CODE 221184 STATE 65536 STACK ${HAPTIC_RT_STACK_BYTES})
haptic_general_program(general_tetrahedron ${images}/image_tetrahedron_image/scene.rtscene 1048576
  ${images}/tetrahedron.ticks)
# Another motion: other bits.
haptic_motion_ticks(other ${scenes}/square_peg_five/motion.toml)
haptic_general_program(general_other_motion ${images}/image_tetrahedron_image/scene.rtscene 1048576
  ${images}/other.ticks)
set_target_properties(image_tetrahedron general_tetrahedron general_other_motion PROPERTIES
  RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/tests)

haptic_image_check(image_bits.tetrahedron ${CMAKE_COMMAND} -DIMAGE=$<TARGET_FILE:image_tetrahedron>
  -DHOSTED=$<TARGET_FILE:general_tetrahedron> -P ${checks}/same_bits.cmake)
haptic_image_refusal(image_bits.probe_other_motion "same bits: the two differ" ${CMAKE_COMMAND}
  -DIMAGE=$<TARGET_FILE:image_tetrahedron> -DHOSTED=$<TARGET_FILE:general_other_motion> -P ${checks}/same_bits.cmake)

# A header that lacks what the scene needs, or is of another scene: the image does not even learn its size.
function(haptic_traits_probe image what from to)
  haptic_image_refusal(image_traits.probe_${what} "scene is not the one that this image was compiled for"
    ${CMAKE_COMMAND} -DHEADER=${images}/${image}_image/include/rt_core/scene/scene_image.hpp "-DFROM=${from}" "-DTO=${to}"
    -DFOLDER=${samples}/traits_${what} "-DCOMPILER=${CMAKE_CXX_COMPILER}" "-DFLAGS=${core_flags}|${user_flags}"
    -DROOT=${PROJECT_SOURCE_DIR} -DEIGEN=${EIGEN3_INCLUDE_DIR} -DREAL_IS_FLOAT=$<STREQUAL:${HAPTIC_REAL},float>
    -DARCHIVE=$<TARGET_FILE:${image}_core>
    "-DOBJECTS=$<JOIN:$<TARGET_OBJECTS:${image}_state_size>,|>|${images}/${image}_state_size_scene.o"
    -P ${checks}/image_traits_probe.cmake)
endfunction()
haptic_traits_probe(image_tetrahedron other_hash "content_hash = 0x[0-9a-f]+u" "content_hash = 0x0123456789abcdefu")

# A budget that nothing keeps.
if(NOT skip_stack)
  haptic_image_refusal(image_budget.probe_stack "bytes of stack with all it calls, limit 64" ${CMAKE_COMMAND}
    -DOBJECTS=${CMAKE_CURRENT_BINARY_DIR}/CMakeFiles/image_tetrahedron_core.dir -DIMAGE=${samples}/image_budget_stack
    -DSTACK=64 -P ${checks}/image_stack_probe.cmake)
else()
  haptic_image_check(image_budget.probe_stack ${CMAKE_COMMAND} -E echo "skipped: ${skip_stack}")
endif()

# The image without operating system refuses what the general one refuses.
function(haptic_closed_image_probe sample expected)
  haptic_image_refusal(image_closed.probe_${sample} "${expected}" ${CMAKE_CXX_COMPILER} -std=c++20 -O2 -fno-pie ${ARGN}
    ${checks}/probes/${sample}.cpp $<TARGET_OBJECTS:image_tetrahedron> ${images}/image_tetrahedron_scene.o
    ${images}/image_tetrahedron_image/state.o ${images}/image_tetrahedron_motion.o -Wl,--whole-archive
    $<TARGET_FILE:image_tetrahedron_core> -Wl,--no-whole-archive -nostdlib -static
    -Wl,-T,${haptic_linker_dir}/bare_metal_example.ld -Wl,--orphan-handling=error -Wl,--build-id=none
    -Wl,-z,noexecstack -o ${samples}/closed_${sample})
endfunction()
haptic_closed_image_probe(heap_malloc "undefined reference to `malloc'")
haptic_closed_image_probe(image_heap "bare metal: a heap is linked" -fno-builtin)
haptic_closed_image_probe(image_constructor "bare metal: a static constructor or destructor is linked")

if(HAPTIC_ALL_CHECKS)
  include(more_images.cmake)
endif()
include(image_report.cmake)
