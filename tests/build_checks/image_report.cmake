# SPDX-License-Identifier: Apache-2.0
# Target image_report: the general program beside the image of each scene, and the image with each omitted feature alone
# compiled in again: bytes of code, constants and state, instructions per tick (callgrind), the same bits in every row.
# Some ten cores per scene are compiled, hence an option of its own:
#   cmake -DHAPTIC_IMAGE_REPORT=ON .. && cmake --build .. --target image_report
option(HAPTIC_IMAGE_REPORT "Define the target image_report" OFF)
set(HAPTIC_IMAGE_REPORT_SCENES "tetrahedron_on_box;tetrahedron_fixed;square_peg_five;square_peg;plug_socket" CACHE STRING
  "Scenes of image_report: folders of host_sim/scenes, or of the shared data where that is present")
set(HAPTIC_IMAGE_REPORT_FEATURES
  "paper;weighted_region;friction;coupling_damping;several_pairs;visit_budget;formed_graphs;wide_lists;fixed_orientation;free_orientation;passivity;device_twist;clutch;contact_geometry;table_checks"
  CACHE STRING "Features of image_report that are compiled in alone")
if(NOT HAPTIC_IMAGE_REPORT)
  return()
endif()
find_program(HAPTIC_VALGRIND valgrind)
mark_as_advanced(HAPTIC_VALGRIND)
set(report_folder ${CMAKE_CURRENT_BINARY_DIR}/image_report)
file(MAKE_DIRECTORY ${report_folder})

# Scene and motion of a part of the shared data, from its task.json, without copying its geometry.
function(haptic_shared_scene name scene_out motion_out)
  set(data ${HAPTIC_SHARED_DIR}/data/${name})
  file(READ ${data}/task.json task)
  set(text "format = 1\nname = \"${name}\"\n")
  foreach(role moving static)
    string(JSON mesh GET "${task}" ${role} file)
    string(JSON scale GET "${task}" ${role} scale_to_m)
    string(APPEND text "[${role}]\nmesh = \"${data}/${mesh}\"\nscale_to_m = ${scale}\n")
    if(role STREQUAL "moving")
      foreach(pose start assembled)
        string(JSON position_${pose} GET "${task}" ${pose}_pose position_m)
        foreach(k RANGE 3)
          string(JSON ${pose}_${k} GET "${task}" ${pose}_pose quaternion_wxyz ${k})
        endforeach()
        set(turn_${pose} "{ w = ${${pose}_0}, x = ${${pose}_1}, y = ${${pose}_2}, z = ${${pose}_3} }")
      endforeach()
      string(APPEND text "position_m = ${position_start}\nquaternion = ${turn_start}\n")
    endif()
  endforeach()
  string(REPLACE "[static]" "[[static]]" text "${text}")
  file(CONFIGURE OUTPUT ${report_folder}/${name}.toml CONTENT "${text}[rendering]\nk_f_n_per_m = 800.0\n" @ONLY)
  set(${scene_out} ${report_folder}/${name}.toml PARENT_SCOPE)
  set(${motion_out} ${data}/trajectory.csv PARENT_SCOPE)
  if(EXISTS ${data}/trajectory.csv)
    return()
  endif()
  # No recorded way: from the start to the assembled pose, where the tremor presses against the walls, and back.
  set(motion "format = 1\nrate_hz = 1000\nseed = 5\n[tremor]\nposition_m = 0.0015\nangle_rad = 0.01\nband_hz = [8.0, 12.0]\n")
  foreach(way "start 0" "assembled 4" "assembled 8" "start 12")
    separate_arguments(way)
    list(GET way 0 pose)
    list(GET way 1 time)
    string(APPEND motion "[[waypoint]]\nphase = \"${pose}\"\nt_s = ${time}.0\nposition_m = ${position_${pose}}\n"
      "quaternion = ${turn_${pose}}\n")
  endforeach()
  file(CONFIGURE OUTPUT ${report_folder}/${name}_motion.toml CONTENT "${motion}" @ONLY)
  set(${motion_out} ${report_folder}/${name}_motion.toml PARENT_SCOPE)
endfunction()

set(report_rows)
set(report_programs)
# Eigen's headers are most of the work of a core; all of these share them precompiled.
set(precompiled)
function(haptic_report_image name scene motion)
  haptic_add_scene_image(${name} SCENE ${scene} SOURCES ${runner} MOTION ${motion} ${ARGN})
  set_target_properties(${name} ${name}_core ${name}_state_size PROPERTIES EXCLUDE_FROM_ALL ON)
  set_target_properties(${name}_core PROPERTIES CXX_COMPILER_LAUNCHER "")
  if(precompiled)
    target_precompile_headers(${name}_core REUSE_FROM ${precompiled})
  else()
    target_precompile_headers(${name}_core PRIVATE <Eigen/Core> <Eigen/Geometry>)
    set(precompiled ${name}_core PARENT_SCOPE)
  endif()
endfunction()

foreach(name IN LISTS HAPTIC_IMAGE_REPORT_SCENES)
  if(EXISTS ${scenes}/${name}/scene.toml)
    set(scene ${scenes}/${name}/scene.toml)
    set(motion ${scenes}/${name}/motion.toml)
  elseif(EXISTS ${HAPTIC_SHARED_DIR}/data/${name}/task.json)
    haptic_shared_scene(${name} scene motion)
  else()
    message(STATUS "image_report: no scene ${name}")
    continue()
  endif()
  haptic_motion_ticks(report_${name} ${motion})
  set(ticks ${CMAKE_CURRENT_BINARY_DIR}/report_${name}.ticks)
  set(image report_image_${name})
  haptic_report_image(${image} ${scene} ${ticks} WITHOUT clutch contact_geometry)
  set(folder ${CMAKE_CURRENT_BINARY_DIR}/${image}_image)
  # Room for any scene; the table states what the scene's header says.
  haptic_general_program(report_general_${name} ${folder}/scene.rtscene ${HAPTIC_RT_STATE_BYTES} ${ticks})
  target_link_options(report_general_${name} PRIVATE -Wl,--gc-sections)
  set_target_properties(report_general_${name} PROPERTIES EXCLUDE_FROM_ALL ON)
  list(APPEND report_rows "${name}|general|$<TARGET_FILE:report_general_${name}>|${folder}"
    "${name}|image|$<TARGET_FILE:${image}>|${folder}")
  list(APPEND report_programs report_general_${name} ${image})
  foreach(feature IN LISTS HAPTIC_IMAGE_REPORT_FEATURES)
    set(left_out clutch contact_geometry)
    list(REMOVE_ITEM left_out ${feature})
    set(with WITH ${feature})
    if(NOT feature IN_LIST left_out AND feature MATCHES "^(clutch|contact_geometry)$")
      set(with)  # on unless left out
    endif()
    haptic_report_image(${image}_${feature} ${scene} ${ticks} WITHOUT ${left_out} ${with})
    list(APPEND report_rows
      "${name}|${feature}|$<TARGET_FILE:${image}_${feature}>|${CMAKE_CURRENT_BINARY_DIR}/${image}_${feature}_image")
    list(APPEND report_programs ${image}_${feature})
  endforeach()
endforeach()

list(JOIN report_rows "\n" rows)
file(GENERATE OUTPUT ${report_folder}/rows.txt CONTENT "${rows}\n")
add_custom_target(image_report
  COMMAND ${CMAKE_COMMAND} -DROWS=${report_folder}/rows.txt -DOUT=${report_folder}/image_report -DNM=${HAPTIC_NM}
    -DVALGRIND=${HAPTIC_VALGRIND} -P ${checks}/image_report_table.cmake
  DEPENDS ${report_programs} VERBATIM)
