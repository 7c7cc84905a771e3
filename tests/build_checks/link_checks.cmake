# SPDX-License-Identifier: Apache-2.0
# Rules of the linker recipe (linker/README.md): the core's place in a hosted program, its budgets, and the freestanding
# image. The programs are built with the rest; probes link violating samples at test time.

set(skip_link "${haptic_no_placement}")
if(NOT skip_link)
  set(skip_link "${skip_compiled}")
endif()
if(NOT skip_link AND NOT TARGET haptic::scene_writer)
  set(skip_link "this build has no scene writer to make the embedded scene")
endif()
if(skip_link)
  foreach(name same_bits placement budget)
    haptic_link_check(${name} ${CMAKE_COMMAND} -E echo "skipped: ${skip_link}")
  endforeach()
  return()
endif()

add_executable(image_scene image_scene.cpp)
target_link_libraries(image_scene PRIVATE haptic::scene_writer haptic_warnings)
set(scene ${CMAKE_CURRENT_BINARY_DIR}/image.rtscene)
add_custom_command(OUTPUT ${scene} COMMAND image_scene ${scene} DEPENDS image_scene VERBATIM)

haptic_add_freestanding(core_freestanding ${scene})

# What a hosted program of the general core runs; images compile the same files for their own scenes.
set(runner ${checks}/hosted_run.cpp ${PROJECT_SOURCE_DIR}/linker/image_run.cpp)
add_library(haptic_hosted_run OBJECT ${runner})
target_link_libraries(haptic_hosted_run PUBLIC haptic::rt_core PRIVATE haptic_warnings)

add_executable(core_hosted)
target_link_libraries(core_hosted PRIVATE haptic_hosted_run)
haptic_place_rt(core_hosted)
haptic_embed_scene(core_hosted ${scene})
haptic_embed_state(core_hosted 1048576)
set_target_properties(image_scene core_freestanding core_hosted PROPERTIES
  RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/tests)

haptic_link_check(same_bits ${CMAKE_COMMAND} -DIMAGE=$<TARGET_FILE:core_freestanding>
  -DHOSTED=$<TARGET_FILE:core_hosted> -P ${checks}/same_bits.cmake)
haptic_link_check(placement ${CMAKE_COMMAND} -DPROGRAM=$<TARGET_FILE:core_hosted> -DARCHIVE=$<TARGET_FILE:rt_core>
  -DNM=${HAPTIC_NM} -P ${checks}/placement.cmake)

# What both kinds of link share: the program's own objects and scene, without the archive.
set(hosted_scene ${CMAKE_CURRENT_BINARY_DIR}/core_hosted_scene.o ${CMAKE_CURRENT_BINARY_DIR}/core_hosted_state.o)
set(hosted_objects $<TARGET_OBJECTS:haptic_hosted_run> ${hosted_scene})
list(JOIN hosted_scene "|" hosted_scene_line)
set(image_objects $<TARGET_OBJECTS:core_freestanding> ${CMAKE_CURRENT_BINARY_DIR}/core_freestanding_scene.o
  ${CMAKE_CURRENT_BINARY_DIR}/core_freestanding_state.o)
set(whole_core -Wl,--whole-archive $<TARGET_FILE:rt_core> -Wl,--no-whole-archive)
file(MAKE_DIRECTORY ${samples})

# A budget that nothing keeps.
foreach(region CODE CONST STATE)
  string(TOLOWER ${region} lower)
  set(budget ${samples}/budget_${lower}.ld)
  haptic_write_budget(${budget} ${region} 8)
  haptic_link_refusal(budget.probe_${lower} "exceeds HAPTIC_RT_${region}_BYTES = 8"
    ${CMAKE_CXX_COMPILER} -Wl,-T,${haptic_linker_dir}/rt_sections.ld ${budget} ${whole_core} ${hosted_objects}
    -o ${samples}/budget_${lower})
endforeach()

# One object of the core given by itself, as an application's sources would be, falls out of the region.
haptic_link_refusal(placement.probe_loose_object ": lies outside .rt_text" ${CMAKE_COMMAND}
  "-DLINK=${CMAKE_CXX_COMPILER}|-Wl,-T,${haptic_linker_dir}/rt_sections.ld|${hosted_scene_line}|$<JOIN:$<TARGET_OBJECTS:haptic_hosted_run>,|>"
  -DARCHIVE=$<TARGET_FILE:rt_core> -DLOOSE=unity_in_rt_core_base_cxx.cxx.o -DAR=${CMAKE_AR} -DNM=${HAPTIC_NM}
  -DFOLDER=${samples}/loose_object -P ${checks}/placement_probe.cmake)
haptic_link_refusal(placement.probe_not_placed "link it through haptic_place_rt" ${CMAKE_COMMAND}
  -DPROGRAM=$<TARGET_FILE:image_scene> -DARCHIVE=$<TARGET_FILE:rt_core> -DNM=${HAPTIC_NM} -P ${checks}/placement.cmake)

# haptic_image_probe(<sample> <text> [compiler options]): the image with one more source file must not link.
function(haptic_image_probe sample expected)
  haptic_link_refusal(freestanding.probe_${sample} "${expected}" ${CMAKE_CXX_COMPILER} -std=c++20 -O2 -fno-pie ${ARGN}
    ${checks}/probes/${sample}.cpp ${image_objects} ${whole_core} -nostdlib -static
    -Wl,-T,${haptic_linker_dir}/bare_metal_example.ld -Wl,--orphan-handling=error -Wl,--build-id=none
    -Wl,-z,noexecstack -o ${samples}/image_${sample})
endfunction()
haptic_image_probe(heap_malloc "undefined reference to `malloc'")
haptic_image_probe(throws "undefined reference to `__cxa_throw'")
haptic_image_probe(image_heap "bare metal: a heap is linked" -fno-builtin)
haptic_image_probe(image_constructor "bare metal: a static constructor or destructor is linked")
haptic_image_probe(writable_global "bare metal: initialised writable data is linked")
haptic_image_probe(image_orphan "unplaced orphan section")
