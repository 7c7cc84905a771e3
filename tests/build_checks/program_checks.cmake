# SPDX-License-Identifier: Apache-2.0
# Rules that read the finished programs.
find_program(HAPTIC_READELF readelf REQUIRED)
mark_as_advanced(HAPTIC_READELF)
set(hardened_program ${CMAKE_COMMAND} -DREADELF=${HAPTIC_READELF} "-DSKIP=${skip_compiled}")

if(HAPTIC_BUILD_TOOLS)
  foreach(program run_device device_bridge host_sim host_lab graph_compiler scene_inspect haptic)
    haptic_build_check(hardened_program.${program} ${hardened_program} -DPROGRAM=$<TARGET_FILE:${program}>
      -P ${checks}/hardened_program.cmake)
  endforeach()
endif()

# The flags of the programs on a sample, then one after the other taken back.
set(hardening_flags "-O2|$<JOIN:$<TARGET_PROPERTY:haptic_hardened,INTERFACE_COMPILE_OPTIONS>,|>")
string(APPEND hardening_flags "|$<JOIN:$<TARGET_PROPERTY:haptic_hardened_program,INTERFACE_LINK_OPTIONS>,|>")
set(hardened_sample ${hardened_program} -DCOMPILER=${CMAKE_CXX_COMPILER}
  -DSAMPLE=${checks}/probes/program_with_buffer.cpp)
haptic_build_check(hardened_program.sample ${hardened_sample} "-DFLAGS=${hardening_flags}"
  -DFOLDER=${samples}/hardened_sample -P ${checks}/hardened_program.cmake)

function(haptic_hardening_probe what flag expected)
  haptic_build_probe(hardened_program.probe_${what} "${expected}" ${hardened_sample}
    "-DFLAGS=${hardening_flags}|${flag}" -DFOLDER=${samples}/hardened_${what} -P ${checks}/hardened_program.cmake)
endfunction()

haptic_hardening_probe(fixed_address "-fno-pie|-no-pie" "lies at a fixed address (no PIE)")
haptic_hardening_probe(no_relro "-Wl,-z,norelro" "its tables of addresses stay writable (no RELRO)")
haptic_hardening_probe(late_binding "-Wl,-z,lazy" "binds functions late, so that RELRO cannot cover them")
haptic_hardening_probe(executable_stack "-Wl,-z,execstack" "its stack may be executed")
haptic_hardening_probe(no_protector "-fno-stack-protector" "nothing checks its stack frames (no stack protector)")
haptic_hardening_probe(no_fortify "-U_FORTIFY_SOURCE" "no call of the C library checks its buffer (no FORTIFY)")
