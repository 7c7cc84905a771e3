# SPDX-License-Identifier: Apache-2.0
# More images of scenes, each with one more core to compile: the peg's as a hosted program without what the scene does not
# ask for, with the probes of placement, traits and budgets; that of a tetrahedron that never turns, on a device; and that
# of a needle of which pruning has left the point.

haptic_motion_ticks(peg ${scenes}/square_peg_five/motion.toml)
haptic_add_scene_image(image_peg SCENE ${scenes}/square_peg_five/scene.toml SOURCES ${runner}
  MOTION ${images}/peg.ticks WITHOUT contact_geometry)
haptic_general_program(general_peg ${images}/image_peg_image/scene.rtscene 1048576 ${images}/peg.ticks)
set_target_properties(image_peg general_peg PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/tests)

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

haptic_traits_probe(image_peg no_law "laws = [0-9]+u" "laws = 2u")
haptic_traits_probe(image_peg no_turn "free_orientation = true" "free_orientation = false")
haptic_traits_probe(image_peg less_room "qp_rows = [0-9]+" "qp_rows = 95")

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

haptic_motion_ticks(tetrahedron_fixed ${scenes}/tetrahedron_fixed/motion.toml)
haptic_add_scene_image(image_fixed SCENE ${device_scene} SOURCES ${runner}
  MOTION ${images}/tetrahedron_fixed.ticks WITHOUT contact_geometry BUDGET CODE 204800 STATE 32768)
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
