# SPDX-License-Identifier: Apache-2.0
# Rules that read what the compiler made of the core. Probes are compiled with the core's own flags.
set(core_flags "$<JOIN:$<TARGET_PROPERTY:rt_core,COMPILE_OPTIONS>,|>|-std=c++20|-O2|-Wno-error")
separate_arguments(user_flags NATIVE_COMMAND "${CMAKE_CXX_FLAGS}")
list(JOIN user_flags "|" user_flags)
set(compile_sample ${CMAKE_COMMAND} -DCOMPILER=${CMAKE_CXX_COMPILER} "-DFLAGS=${core_flags}|${user_flags}"
  -DROOT=${PROJECT_SOURCE_DIR})

haptic_build_check(archive_symbols ${CMAKE_COMMAND} -DARCHIVE=$<TARGET_FILE:rt_core> -DNM=${HAPTIC_NM}
  -DOBJDUMP=${HAPTIC_OBJDUMP} "-DSKIP=${skip_compiled}" -P ${checks}/archive_symbols.cmake)
haptic_build_check(archive_symbols.servo ${CMAKE_COMMAND} -DARCHIVE=$<TARGET_FILE:rt_servo> -DBESIDE=$<TARGET_FILE:rt_core>
  -DNM=${HAPTIC_NM} -DOBJDUMP=${HAPTIC_OBJDUMP} "-DSKIP=${skip_compiled}" -P ${checks}/archive_symbols.cmake)

function(haptic_archive_probe sample expected)
  list(JOIN ARGN "|" extra)
  set(command ${compile_sample})
  list(TRANSFORM command APPEND "|${extra}" REGEX "^-DFLAGS=")
  haptic_build_probe(archive_symbols.probe_${sample} "${expected}" ${command}
    -DSAMPLE=${checks}/probes/${sample}.cpp -DFOLDER=${samples}/archive_${sample} -DCHECK=archive
    -DAR=${CMAKE_AR} -DNM=${HAPTIC_NM} -DOBJDUMP=${HAPTIC_OBJDUMP} "-DSKIP=${skip_compiled}"
    -P ${checks}/compile_sample.cmake)
endfunction()

haptic_archive_probe(heap_malloc "heap_malloc.cpp.o needs 'malloc' (heap)")
haptic_archive_probe(heap_new "heap_new.cpp.o needs '_Znwm' (heap)")
haptic_archive_probe(eigen_product "eigen_product.cpp.o needs 'malloc' (heap)" -isystem${EIGEN3_INCLUDE_DIR})
haptic_archive_probe(throws "throws.cpp.o needs '__cxa_throw' (exception or run-time type)" -fexceptions)
haptic_archive_probe(locks "locks.cpp.o needs 'pthread_mutex_lock' (lock)")
haptic_archive_probe(guarded_local "guarded_local.cpp.o needs '__cxa_guard_acquire' (lock)" -fthreadsafe-statics)
haptic_archive_probe(calls_sin "calls_sin.cpp.o needs 'sin' (libm)")
haptic_archive_probe(writable_global "writable_global.cpp.o has a writable global in .data.tick_gain")
haptic_archive_probe(zero_global "zero_global.cpp.o has a writable global in .bss.tick_count")
haptic_archive_probe(static_constructor "static_constructor.cpp.o has a static constructor")

# The device's side of the protocol, as a firmware compiles it: it calls nothing but the four functions and holds nothing.
set(firmware ${CMAKE_COMMAND} -DCOMPILER=${CMAKE_C_COMPILER} "-DFLAGS=-std=c99|-ffreestanding|-Os" -DROOT=${PROJECT_SOURCE_DIR}
  -DCHECK=archive -DAR=${CMAKE_AR} -DNM=${HAPTIC_NM} -DOBJDUMP=${HAPTIC_OBJDUMP})
haptic_build_check(archive_symbols.firmware ${firmware} -DSAMPLE=${PROJECT_SOURCE_DIR}/hal/firmware/reference_device.c
  -DFOLDER=${samples}/archive_firmware -P ${checks}/compile_sample.cmake)
haptic_build_probe(archive_symbols.probe_firmware "firmware_heap.c.o needs 'malloc' (heap)" ${firmware}
  -DSAMPLE=${checks}/probes/firmware_heap.c -DFOLDER=${samples}/archive_firmware_heap -P ${checks}/compile_sample.cmake)

# The core for wide registers uses them, and the plain one does not.
if(TARGET rt_core_wide)
  set(wide_registers ${CMAKE_COMMAND} -DOBJDUMP=${HAPTIC_OBJDUMP} "-DSKIP=${skip_compiled}")
  haptic_build_check(wide_registers ${wide_registers} -DARCHIVE=$<TARGET_FILE:rt_core_wide>
    -P ${checks}/wide_registers.cmake)
  haptic_build_probe(wide_registers.probe_plain_core "no 256-bit register in" ${wide_registers}
    -DARCHIVE=$<TARGET_FILE:rt_core> -P ${checks}/wide_registers.cmake)
endif()

# The limits: one frame, and the deepest chain of calls of a tick; linker/bare_metal_example.ld reserves the latter.
set(frame_limit_bytes 4096)
set(stack_limit_bytes ${HAPTIC_RT_STACK_BYTES})
if(NOT skip_stack)
  # The graphs must be those of the very objects in the archive, and ccache does not keep them.
  foreach(library rt_core rt_servo)
    target_compile_options(${library} PRIVATE -fcallgraph-info=su)
    set_target_properties(${library} PROPERTIES CXX_COMPILER_LAUNCHER "")
  endforeach()
elseif(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # Frames of -O0 and of sanitizers say nothing about the release; they must not stop a build with -Werror.
  target_compile_options(rt_core PRIVATE -Wno-stack-usage)
  target_compile_options(rt_servo PRIVATE -Wno-stack-usage)
endif()
get_target_property(core_folder rt_core BINARY_DIR)
haptic_build_check(stack_bound ${CMAKE_COMMAND} -DFOLDER=${core_folder}/CMakeFiles
  -DLIMIT=${frame_limit_bytes} -DTOTAL=${stack_limit_bytes} "-DSKIP=${skip_stack}" -P ${haptic_linker_dir}/stack_bound.cmake)

# The same figures for the simulator's reports.
set(stack_header ${PROJECT_BINARY_DIR}/generated/rt_core_stack.hpp)
add_custom_command(OUTPUT ${PROJECT_BINARY_DIR}/generated/rt_core_stack.stamp BYPRODUCTS ${stack_header}
  COMMAND ${CMAKE_COMMAND} -DFOLDER=${core_folder}/CMakeFiles -DLIMIT=${frame_limit_bytes}
    -DTOTAL=${stack_limit_bytes} "-DSKIP=${skip_stack}" -DHEADER=${stack_header} -P ${haptic_linker_dir}/stack_bound.cmake
  COMMAND ${CMAKE_COMMAND} -E touch ${PROJECT_BINARY_DIR}/generated/rt_core_stack.stamp
  DEPENDS rt_core rt_servo $<TARGET_FILE:rt_core> $<TARGET_FILE:rt_servo> ${haptic_linker_dir}/stack_bound.cmake VERBATIM)
add_custom_target(rt_core_stack DEPENDS ${PROJECT_BINARY_DIR}/generated/rt_core_stack.stamp)
if(TARGET haptic_host_sim)
  add_dependencies(haptic_host_sim rt_core_stack)
endif()

function(haptic_stack_probe sample expected)
  haptic_build_probe(stack_bound.probe_${sample} "${expected}" ${compile_sample}
    -DSAMPLE=${checks}/probes/${sample}.cpp -DFOLDER=${samples}/stack_${sample} -DCHECK=stack
    -DLIMIT=${frame_limit_bytes} -DTOTAL=${stack_limit_bytes} "-DSKIP=${skip_stack}" -P ${checks}/compile_sample.cmake)
endfunction()

haptic_stack_probe(large_frame "large_frame(): frame of")
haptic_stack_probe(split_frame "samples::{anonymous}::Search::search_fully(int) [part]: frame of")
haptic_stack_probe(dynamic_frame "dynamic_frame(unsigned int): dynamic stack")
haptic_stack_probe(recursion "recursion(int): recursion")
haptic_stack_probe(mutual_recursion "recursion through other functions")
haptic_stack_probe(pointer_call "call through a pointer")
haptic_stack_probe(deep_chain "bytes of stack with all it calls, limit ${stack_limit_bytes}")
