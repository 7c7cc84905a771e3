# SPDX-License-Identifier: Apache-2.0
# Images of scenes of the project (linker/SceneImage.cmake): the tetrahedron's without operating system; the peg's as a
# hosted program without what the scene does not ask for. Each image is one more core to compile; with HAPTIC_ALL_CHECKS
# also that of a tetrahedron that never turns, on a device, and that of a needle of which pruning has left the point.
# Each must compute the bits of the general program along the scene's motion, and stop at any other scene.

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
haptic_motion_ticks(peg ${scenes}/square_peg_five/motion.toml)
haptic_add_scene_image(image_tetrahedron FREESTANDING SCENE ${scenes}/tetrahedron_on_box/scene.toml
  MOTION ${images}/tetrahedron.ticks BUDGET CODE 217088 STATE 65536 STACK ${HAPTIC_RT_STACK_BYTES})
haptic_add_scene_image(image_peg SCENE ${scenes}/square_peg_five/scene.toml SOURCES ${runner}
  MOTION ${images}/peg.ticks WITHOUT contact_geometry)
haptic_general_program(general_tetrahedron ${images}/image_tetrahedron_image/scene.rtscene 1048576
  ${images}/tetrahedron.ticks)
haptic_general_program(general_peg ${images}/image_peg_image/scene.rtscene 1048576 ${images}/peg.ticks)
set_target_properties(image_tetrahedron image_peg general_tetrahedron general_peg PROPERTIES
  RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/tests)

haptic_image_check(image_bits.tetrahedron ${CMAKE_COMMAND} -DIMAGE=$<TARGET_FILE:image_tetrahedron>
  -DHOSTED=$<TARGET_FILE:general_tetrahedron> -P ${checks}/same_bits.cmake)
haptic_image_check(image_bits.peg ${CMAKE_COMMAND} -DIMAGE=$<TARGET_FILE:image_peg>
  -DHOSTED=$<TARGET_FILE:general_peg> -DIN_PROCESS=ON -P ${checks}/same_bits.cmake)
haptic_image_refusal(image_bits.probe_other_scene "same bits: the two differ" ${CMAKE_COMMAND}
  -DIMAGE=$<TARGET_FILE:image_peg> -DHOSTED=$<TARGET_FILE:general_tetrahedron> -DIN_PROCESS=ON -P ${checks}/same_bits.cmake)
haptic_image_check(image_placement ${CMAKE_COMMAND} -DPROGRAM=$<TARGET_FILE:image_peg>
  -DARCHIVE=$<TARGET_FILE:image_peg_core> -DNM=${HAPTIC_NM} -P ${checks}/placement.cmake)
haptic_image_refusal(image_placement.probe_other_core "lies outside .rt_text" ${CMAKE_COMMAND}
  "-DLINK=${CMAKE_CXX_COMPILER}|-Wl,-T,${haptic_linker_dir}/rt_sections.ld|${images}/image_peg_scene.o|${images}/image_peg_image/state.o|${images}/image_peg_motion.o|$<JOIN:$<TARGET_OBJECTS:image_peg>,|>"
  -DARCHIVE=$<TARGET_FILE:image_peg_core> -DLOOSE=unity_in_rt_core_base_cxx.cxx.o -DAR=${CMAKE_AR} -DNM=${HAPTIC_NM}
  -DFOLDER=${samples}/image_loose_object -P ${checks}/placement_probe.cmake)

# What the program of an image is linked from, without its scene.
set(peg_link ${CMAKE_CXX_COMPILER} -Wl,-T,${haptic_linker_dir}/rt_sections.ld -Wl,--whole-archive
  $<TARGET_FILE:image_peg_core> -Wl,--no-whole-archive -Wl,--gc-sections "$<JOIN:$<TARGET_OBJECTS:image_peg>,|>"
  ${images}/image_peg_image/state.o ${images}/image_peg_motion.o)
list(JOIN peg_link "|" peg_link)

# The blob of another scene: the image opens none but its own.
haptic_image_refusal(image_scene.probe_other_blob "verdict 3 " ${CMAKE_COMMAND}
  "-DLINK=${peg_link}|${images}/image_tetrahedron_scene.o" -DPROGRAM=${samples}/image_other_blob
  -P ${checks}/image_run_probe.cmake)

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
haptic_traits_probe(image_peg no_law "laws = [0-9]+u" "laws = 2u")
haptic_traits_probe(image_peg no_turn "free_orientation = true" "free_orientation = false")
haptic_traits_probe(image_peg less_room "qp_rows = [0-9]+" "qp_rows = 95")
haptic_traits_probe(image_peg other_hash "content_hash = 0x[0-9a-f]+u" "content_hash = 0x0123456789abcdefu")

# Budgets that nothing keeps, given as an argument and by the scene's report.
foreach(region CODE CONST STATE)
  set(budget ${samples}/image_budget_${region})
  haptic_image_refusal(image_budget.probe_${region} "exceeds the image's budget ${region} = 8" ${CMAKE_COMMAND}
    "-DLINK=${peg_link}|${images}/image_peg_scene.o" -DREPORT=${images}/image_peg_image/report.json
    -DREGION=${region} -DFOLDER=${budget} -DTEMPLATES=${haptic_linker_dir} -P ${checks}/image_budget_probe.cmake)
endforeach()
haptic_image_refusal(image_budget.probe_scene "exceeds [budget] state_bytes = 8" ${CMAKE_COMMAND}
  "-DLINK=${peg_link}|${images}/image_peg_scene.o" -DREPORT=${images}/image_peg_image/report.json
  -DREGION=SCENE -DFOLDER=${samples}/image_budget_SCENE -DTEMPLATES=${haptic_linker_dir}
  -P ${checks}/image_budget_probe.cmake)
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
  haptic_motion_ticks(tetrahedron_fixed ${scenes}/tetrahedron_fixed/motion.toml)
  haptic_add_scene_image(image_fixed SCENE ${device_scene} SOURCES ${runner}
    MOTION ${images}/tetrahedron_fixed.ticks WITHOUT contact_geometry BUDGET CODE 110592 STATE 28672)
  haptic_general_program(general_fixed ${images}/image_fixed_image/scene.rtscene 1048576
    ${images}/tetrahedron_fixed.ticks)
  set_target_properties(image_fixed general_fixed PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/tests)
  haptic_image_check(image_bits.fixed ${CMAKE_COMMAND} -DIMAGE=$<TARGET_FILE:image_fixed>
    -DHOSTED=$<TARGET_FILE:general_fixed> -DIN_PROCESS=ON -P ${checks}/same_bits.cmake)
  haptic_traits_probe(image_fixed no_device "device = true" "device = false")
  haptic_traits_probe(image_fixed less_visits "valid_visits = [0-9]+" "valid_visits = 2")

  haptic_motion_ticks(needle ${checks}/needle/motion.toml)
  haptic_add_scene_image(image_needle SCENE ${checks}/needle/scene.toml SOURCES ${runner}
    MOTION ${images}/needle.ticks WITHOUT contact_geometry)
  haptic_general_program(general_needle ${images}/image_needle_image/scene.rtscene 1048576 ${images}/needle.ticks)
  set_target_properties(image_needle general_needle PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/tests)
  haptic_image_check(image_bits.needle ${CMAKE_COMMAND} -DIMAGE=$<TARGET_FILE:image_needle>
    -DHOSTED=$<TARGET_FILE:general_needle> -DIN_PROCESS=ON -P ${checks}/same_bits.cmake)
  haptic_traits_probe(image_needle less_visits_of_pruned "valid_visits = [0-9]+" "valid_visits = 2")
endif()
include(image_report.cmake)
