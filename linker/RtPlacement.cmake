# SPDX-License-Identifier: Apache-2.0
# Where the linker puts the core, and how much room it has there.
#   haptic_place_rt(<program>)               the core's code, constants and state of a hosted program in three regions
#   haptic_embed_scene(<program> <file>)     a compiled scene between rt_scene_blob and rt_scene_blob_end
#   haptic_embed_state(<program> <bytes>)    memory of one core between rt_state and rt_state_end
#   haptic_embed_motion(<program> <file>)    poses for image_run.hpp between rt_motion and rt_motion_end
#   haptic_add_freestanding(<name> <scene>)  an image of the core without operating system and C library
include_guard(GLOBAL)

option(HAPTIC_RT_PLACEMENT "Place the core's code, constants and state in page-aligned regions" ON)
set(HAPTIC_RT_CODE_BYTES 516096 CACHE STRING "Budget of the core's code [bytes]")
set(HAPTIC_RT_CONST_BYTES 67108864 CACHE STRING "Budget of the core's constants and of an embedded scene [bytes]")
set(HAPTIC_RT_STATE_BYTES 4194304 CACHE STRING "Budget of the core's state [bytes]")
set(HAPTIC_RT_STACK_BYTES 32768 CACHE STRING "Stack that the core may need from step() downwards [bytes]")
set(haptic_linker_dir ${CMAKE_CURRENT_LIST_DIR} CACHE INTERNAL "")

# Why placement does not apply to this build; empty when it does.
set(haptic_no_placement "")
if(NOT CMAKE_SYSTEM_NAME STREQUAL "Linux" OR NOT CMAKE_SYSTEM_PROCESSOR STREQUAL "x86_64")
  set(haptic_no_placement "the linker scripts are for x86-64 Linux")
elseif(CMAKE_CXX_FLAGS MATCHES "-fsanitize")
  set(haptic_no_placement "sanitizers lay out memory themselves")
elseif(NOT HAPTIC_RT_PLACEMENT)
  set(haptic_no_placement "HAPTIC_RT_PLACEMENT is off")
endif()
set(haptic_no_placement "${haptic_no_placement}" CACHE INTERNAL "")

# Writes the budget asserts into `file` with the present limits, or with one of them replaced (CODE, CONST or STATE, and bytes).
function(haptic_write_budget file)
  if(ARGC EQUAL 3)
    set(HAPTIC_RT_${ARGV1}_BYTES ${ARGV2})
  endif()
  configure_file(${haptic_linker_dir}/rt_budget.ld.in ${file} @ONLY)
endfunction()

function(haptic_place_rt target)
  if(haptic_no_placement)
    message(STATUS "${target}: core not placed, ${haptic_no_placement}")
    return()
  endif()
  set(budget ${PROJECT_BINARY_DIR}/linker/rt_budget.ld)
  haptic_write_budget(${budget})
  # Options come before the objects: of an inline function that both hold, the linker keeps the core's copy.
  target_link_options(${target} PRIVATE -Wl,-T,${haptic_linker_dir}/rt_sections.ld ${budget}
    -Wl,--whole-archive $<TARGET_FILE:rt_core> -Wl,--no-whole-archive)
  add_dependencies(${target} rt_core)
  set_property(TARGET ${target} APPEND PROPERTY LINK_DEPENDS
    ${haptic_linker_dir}/rt_sections.ld ${budget} $<TARGET_FILE:rt_core>)
endfunction()

# The project's language is C++ alone; its compiler assembles as well. Further arguments: what the source includes.
function(haptic_assemble target source object)
  # An object states the processor it is for.
  separate_arguments(flags NATIVE_COMMAND "${CMAKE_CXX_FLAGS}")
  add_custom_command(OUTPUT ${object} COMMAND ${CMAKE_CXX_COMPILER} ${flags} -c ${source} -o ${object}
    DEPENDS ${source} ${ARGN} COMMENT "Assembling ${object}" VERBATIM)
  set_source_files_properties(${object} PROPERTIES EXTERNAL_OBJECT ON GENERATED ON)
  target_sources(${target} PRIVATE ${object})
endfunction()

function(haptic_embed_scene target scene)
  set(HAPTIC_SCENE_FILE ${scene})
  set(source ${CMAKE_CURRENT_BINARY_DIR}/${target}_scene.S)
  configure_file(${haptic_linker_dir}/scene_blob.S.in ${source} @ONLY)
  haptic_assemble(${target} ${source} ${CMAKE_CURRENT_BINARY_DIR}/${target}_scene.o ${scene})
endfunction()

function(haptic_embed_state target bytes)
  set(HAPTIC_STATE_BYTES ${bytes})
  set(source ${CMAKE_CURRENT_BINARY_DIR}/${target}_state.S)
  configure_file(${haptic_linker_dir}/image_state.S.in ${source} @ONLY)
  haptic_assemble(${target} ${source} ${CMAKE_CURRENT_BINARY_DIR}/${target}_state.o)
endfunction()

function(haptic_embed_motion target motion)
  set(HAPTIC_MOTION_FILE ${motion})
  set(source ${CMAKE_CURRENT_BINARY_DIR}/${target}_motion.S)
  configure_file(${haptic_linker_dir}/image_motion.S.in ${source} @ONLY)
  haptic_assemble(${target} ${source} ${CMAKE_CURRENT_BINARY_DIR}/${target}_motion.o ${motion})
endfunction()

# A program without C library over `core`, an archive named librt_core.a; scene, state and stack size are the caller's.
function(haptic_freestanding_program name core)
  add_executable(${name} ${haptic_linker_dir}/freestanding_start.cpp ${haptic_linker_dir}/image_run.cpp ${ARGN})
  target_link_libraries(${name} PRIVATE $<LINK_LIBRARY:WHOLE_ARCHIVE,${core}> haptic_warnings)
  target_compile_options(${name} PRIVATE -fno-exceptions -fno-rtti -fno-threadsafe-statics -fno-math-errno
    -fno-asynchronous-unwind-tables -fno-stack-protector -fno-pie -ffunction-sections)
  # The four functions of memory must not be compiled into calls of themselves.
  set_property(SOURCE ${haptic_linker_dir}/freestanding_start.cpp TARGET_DIRECTORY ${name} PROPERTY COMPILE_OPTIONS
    "-fno-builtin;$<$<CXX_COMPILER_ID:GNU>:-fno-tree-loop-distribute-patterns>")
  target_link_options(${name} PRIVATE -nostdlib -static -Wl,-T,${haptic_linker_dir}/bare_metal_example.ld
    -Wl,--orphan-handling=error -Wl,--print-memory-usage -Wl,--build-id=none -Wl,-z,noexecstack)
  set_property(TARGET ${name} APPEND PROPERTY LINK_DEPENDS ${haptic_linker_dir}/bare_metal_example.ld)
endfunction()

function(haptic_add_freestanding name scene)
  haptic_freestanding_program(${name} rt_core ${ARGN})
  target_link_options(${name} PRIVATE -Wl,--defsym=haptic_stack_bytes=${HAPTIC_RT_STACK_BYTES})
  haptic_embed_scene(${name} ${scene})
  haptic_embed_state(${name} 1048576)
endfunction()
