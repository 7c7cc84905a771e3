# SPDX-License-Identifier: Apache-2.0
# Where the linker puts the core, and how much room it has there.
#   haptic_place_rt(<program>)               the core's code, constants and state of a hosted program in three regions
#   haptic_embed_scene(<program> <file>)     a compiled scene between rt_scene_blob and rt_scene_blob_end
#   haptic_add_freestanding(<name> <scene>)  an image of the core without operating system and C library
include_guard(GLOBAL)

option(HAPTIC_RT_PLACEMENT "Place the core's code, constants and state in page-aligned regions" ON)
set(HAPTIC_RT_CODE_BYTES 262144 CACHE STRING "Budget of the core's code [bytes]")
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

function(haptic_embed_scene target scene)
  set(HAPTIC_SCENE_FILE ${scene})
  set(source ${CMAKE_CURRENT_BINARY_DIR}/${target}_scene.S)
  set(object ${CMAKE_CURRENT_BINARY_DIR}/${target}_scene.o)
  configure_file(${haptic_linker_dir}/scene_blob.S.in ${source} @ONLY)
  # The project's language is C++ alone; its compiler assembles as well.
  add_custom_command(OUTPUT ${object} COMMAND ${CMAKE_CXX_COMPILER} -c ${source} -o ${object}
    DEPENDS ${source} ${scene} COMMENT "Embedding ${scene}" VERBATIM)
  set_source_files_properties(${object} PROPERTIES EXTERNAL_OBJECT ON GENERATED ON)
  target_sources(${target} PRIVATE ${object})
endfunction()

function(haptic_add_freestanding name scene)
  add_executable(${name} ${haptic_linker_dir}/freestanding_start.cpp ${haptic_linker_dir}/image_run.cpp ${ARGN})
  target_link_libraries(${name} PRIVATE $<LINK_LIBRARY:WHOLE_ARCHIVE,rt_core> haptic_warnings)
  target_compile_definitions(${name} PRIVATE HAPTIC_IMAGE_STATE_BYTES=1048576)
  target_compile_options(${name} PRIVATE -fno-exceptions -fno-rtti -fno-threadsafe-statics -fno-math-errno
    -fno-asynchronous-unwind-tables -fno-stack-protector -fno-pie -ffunction-sections)
  # The four functions of memory must not be compiled into calls of themselves.
  set_source_files_properties(${haptic_linker_dir}/freestanding_start.cpp PROPERTIES COMPILE_OPTIONS
    "-fno-builtin;$<$<CXX_COMPILER_ID:GNU>:-fno-tree-loop-distribute-patterns>")
  target_link_options(${name} PRIVATE -nostdlib -static -Wl,-T,${haptic_linker_dir}/bare_metal_example.ld
    -Wl,--defsym=haptic_stack_bytes=${HAPTIC_RT_STACK_BYTES} -Wl,--orphan-handling=error -Wl,--print-memory-usage
    -Wl,--build-id=none -Wl,-z,noexecstack)
  set_property(TARGET ${name} APPEND PROPERTY LINK_DEPENDS ${haptic_linker_dir}/bare_metal_example.ld)
  haptic_embed_scene(${name} ${scene})
endfunction()
