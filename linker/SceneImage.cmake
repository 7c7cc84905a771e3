# SPDX-License-Identifier: Apache-2.0
# A program with a core compiled for one scene.
#   haptic_add_scene_image(<target> SCENE <scene.toml> [SOURCES <files>] [FREESTANDING] [MOTION <file>]
#     [WITHOUT <features>] [WITH <features>] [BUDGET [CODE n] [CONST n] [STATE n] [STACK n]] [STATE_BYTES n])
# <target>        the program: SOURCES, a placed core, the scene in .rt_scene, its state in .bss.rt_state; with FREESTANDING
#                 and no SOURCES the drive of image_run.hpp without operating system
# <target>_core   the core for this scene; its archive is named librt_core.a, as the linker scripts expect
# Budgets are the scene's [budget], or those given here [bytes]; they hold for what is used, not for whole pages.
include_guard(GLOBAL)
include(${CMAKE_CURRENT_LIST_DIR}/RtPlacement.cmake)

set(HAPTIC_GRAPH_COMPILER "" CACHE FILEPATH
  "graph_compiler of a host build, for images that are cross compiled; empty: the one built here")

# The compiled scene, its report and the header with its traits in <folder>.
function(haptic_compile_image_scene folder scene)
  if(HAPTIC_GRAPH_COMPILER)
    set(compiler ${HAPTIC_GRAPH_COMPILER})
  elseif(TARGET graph_compiler AND NOT CMAKE_CROSSCOMPILING)
    set(compiler graph_compiler)
  else()
    message(FATAL_ERROR "images need graph_compiler: give the program of a host build as HAPTIC_GRAPH_COMPILER")
  endif()
  # Meshes named in the scene file are inputs too; a new name is one more run of CMake.
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${scene})
  get_filename_component(base ${scene} DIRECTORY)
  file(STRINGS ${scene} lines REGEX "^[ \t]*mesh[ \t]*=")
  set(meshes)
  foreach(line IN LISTS lines)
    if(line MATCHES "=[ \t]*[\"']([^\"']+)[\"']")
      get_filename_component(mesh ${CMAKE_MATCH_1} ABSOLUTE BASE_DIR ${base})
      list(APPEND meshes ${mesh})
    endif()
  endforeach()
  set(options)
  foreach(feature IN LISTS ARG_WITHOUT)
    list(APPEND options --without ${feature})
  endforeach()
  foreach(feature IN LISTS ARG_WITH)
    list(APPEND options --with ${feature})
  endforeach()
  file(MAKE_DIRECTORY ${folder}/include/rt_core/scene)
  add_custom_command(
    OUTPUT ${folder}/scene.rtscene ${folder}/report.json ${folder}/include/rt_core/scene/scene_image.hpp
    COMMAND ${compiler} ${scene} -o ${folder}/scene.rtscene --report ${folder}/report.json --quiet
      --traits ${folder}/include/rt_core/scene/scene_image.hpp ${options}
    DEPENDS ${compiler} ${scene} ${meshes} COMMENT "Compiling ${scene} for an image" VERBATIM)
endfunction()

# The core for the traits in <folder>, with the flags of rt_core.
function(haptic_add_image_core name folder)
  get_target_property(sources rt_core SOURCES)
  get_target_property(root rt_core SOURCE_DIR)
  list(FILTER sources INCLUDE REGEX "\\.cpp$")
  list(TRANSFORM sources PREPEND ${root}/)
  add_library(${name} STATIC ${sources} ${folder}/include/rt_core/scene/scene_image.hpp)
  set_target_properties(${name} PROPERTIES OUTPUT_NAME rt_core ARCHIVE_OUTPUT_DIRECTORY ${folder}
    INTERPROCEDURAL_OPTIMIZATION OFF)
  target_compile_definitions(${name} PUBLIC HAPTIC_SCENE_IMAGE=1
    $<TARGET_PROPERTY:rt_core,INTERFACE_COMPILE_DEFINITIONS>)
  target_include_directories(${name} PUBLIC ${folder}/include ${PROJECT_SOURCE_DIR})
  target_include_directories(${name} SYSTEM PUBLIC ${EIGEN3_INCLUDE_DIRS})
  target_compile_options(${name} PUBLIC $<TARGET_PROPERTY:rt_core,INTERFACE_COMPILE_OPTIONS>
    PRIVATE $<TARGET_PROPERTY:rt_core,COMPILE_OPTIONS>)
  target_link_libraries(${name} PUBLIC Eigen3::Eigen PRIVATE haptic_warnings)
  haptic_unity(${name})
endfunction()

# Stops the build when the deepest chain of calls of the core needs more than the stack budget. Only g++ writes the graphs.
function(haptic_bound_image_stack target folder)
  if(NOT CMAKE_CXX_COMPILER_ID STREQUAL "GNU" OR NOT CMAKE_BUILD_TYPE MATCHES "^(Release|RelWithDebInfo|MinSizeRel)$")
    return()
  endif()
  target_compile_options(${target}_core PRIVATE -fcallgraph-info=su)
  set_target_properties(${target}_core PROPERTIES CXX_COMPILER_LAUNCHER "")  # ccache does not keep the graphs
  get_target_property(objects ${target}_core BINARY_DIR)
  add_custom_command(OUTPUT ${folder}/stack.txt
    COMMAND ${CMAKE_COMMAND} -DOBJECTS=${objects}/CMakeFiles/${target}_core.dir -DIMAGE=${folder}
      -P ${haptic_linker_dir}/image_stack.cmake
    DEPENDS ${target}_core ${folder}/link.rsp COMMENT "Bounding the stack of ${target}" VERBATIM)
  target_sources(${target} PRIVATE ${folder}/stack.txt)
  set_property(TARGET ${target} APPEND PROPERTY LINK_DEPENDS ${folder}/stack.txt)
endfunction()

function(haptic_add_scene_image target)
  cmake_parse_arguments(ARG "FREESTANDING" "SCENE;MOTION;STATE_BYTES" "SOURCES;WITHOUT;WITH;BUDGET" ${ARGN})
  cmake_parse_arguments(LIMIT "" "CODE;CONST;STATE;STACK" "" ${ARG_BUDGET})
  if(NOT ARG_SCENE OR ARG_UNPARSED_ARGUMENTS OR LIMIT_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "haptic_add_scene_image(${target}): see linker/SceneImage.cmake for the arguments; "
      "not understood: ${ARG_UNPARSED_ARGUMENTS} ${LIMIT_UNPARSED_ARGUMENTS}")
  endif()
  if(NOT ARG_SOURCES AND NOT ARG_FREESTANDING)
    message(FATAL_ERROR "haptic_add_scene_image(${target}): give the program's SOURCES, or FREESTANDING")
  endif()
  if(haptic_no_placement)
    message(FATAL_ERROR "haptic_add_scene_image(${target}): an image is placed, and here ${haptic_no_placement}")
  endif()
  get_filename_component(scene ${ARG_SCENE} ABSOLUTE)
  set(folder ${CMAKE_CURRENT_BINARY_DIR}/${target}_image)
  haptic_compile_image_scene(${folder} ${scene})
  haptic_add_image_core(${target}_core ${folder})

  # The core itself tells how much state it needs; where it cannot run here, the caller does.
  set(sized PROGRAM)
  set(size ${ARG_STATE_BYTES})
  set(measure)
  if(ARG_STATE_BYTES)
    set(sized STATE_BYTES)
  elseif(CMAKE_CROSSCOMPILING AND NOT CMAKE_CROSSCOMPILING_EMULATOR)
    message(FATAL_ERROR "haptic_add_scene_image(${target}): give STATE_BYTES, or an emulator that runs its state_size")
  else()
    set(measure ${target}_state_size)
    add_executable(${measure} ${haptic_linker_dir}/../tools/graph_compiler/program/state_size.cpp)
    target_link_libraries(${measure} PRIVATE ${target}_core haptic_warnings)
    haptic_embed_scene(${measure} ${folder}/scene.rtscene)
    set(size "$<TARGET_FILE:${measure}>")
    if(CMAKE_CROSSCOMPILING)
      set(size "${CMAKE_CROSSCOMPILING_EMULATOR};${size}")
    endif()
  endif()
  add_custom_command(OUTPUT ${folder}/state.S ${folder}/budget.ld ${folder}/link.rsp
    COMMAND ${CMAKE_COMMAND} -DFOLDER=${folder} -DTEMPLATES=${haptic_linker_dir} "-D${sized}=${size}"
      -DCODE=${LIMIT_CODE} -DCONST=${LIMIT_CONST} -DSTATE=${LIMIT_STATE} -DSTACK=${LIMIT_STACK}
      -DDEFAULT_STACK=${HAPTIC_RT_STACK_BYTES} -P ${haptic_linker_dir}/image_files.cmake
    DEPENDS ${measure} ${folder}/report.json ${haptic_linker_dir}/image_files.cmake
      ${haptic_linker_dir}/image_state.S.in ${haptic_linker_dir}/image_budget.ld.in VERBATIM)

  if(ARG_FREESTANDING)
    haptic_freestanding_program(${target} ${target}_core ${ARG_SOURCES})
    target_link_options(${target} PRIVATE -Wl,@${folder}/link.rsp)
  else()
    add_executable(${target} ${ARG_SOURCES})
    target_link_libraries(${target} PRIVATE ${target}_core haptic_warnings)
    target_link_options(${target} PRIVATE -Wl,-T,${haptic_linker_dir}/rt_sections.ld
      -Wl,--whole-archive $<TARGET_FILE:${target}_core> -Wl,--no-whole-archive)
    set_property(TARGET ${target} APPEND PROPERTY LINK_DEPENDS ${haptic_linker_dir}/rt_sections.ld)
  endif()
  # The archive goes in whole, for its copies of inline functions; what is not reached goes out again.
  target_link_options(${target} PRIVATE -Wl,--gc-sections ${folder}/budget.ld)
  set_property(TARGET ${target} APPEND PROPERTY LINK_DEPENDS ${folder}/budget.ld ${folder}/link.rsp
    $<TARGET_FILE:${target}_core>)
  haptic_embed_scene(${target} ${folder}/scene.rtscene)
  haptic_assemble(${target} ${folder}/state.S ${folder}/state.o)
  if(ARG_MOTION)
    haptic_embed_motion(${target} ${ARG_MOTION})
  endif()
  file(STRINGS ${scene} bounded REGEX "^[ \t]*stack_bytes[ \t]*=")
  if(bounded OR LIMIT_STACK)
    haptic_bound_image_stack(${target} ${folder})
  endif()
endfunction()
