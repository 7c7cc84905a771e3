# SPDX-License-Identifier: Apache-2.0
# Files of an image that the compiled scene decides, written when the image is built.
# cmake -DFOLDER=<of the image> -DTEMPLATES=<linker folder> [-DPROGRAM=<state_size> | -DSTATE_BYTES=<n>]
#   [-DCODE=..] [-DCONST=..] [-DSTATE=..] [-DSTACK=..] -DDEFAULT_STACK=.. -P image_files.cmake
# Reads report.json; writes state.S, budget.ld and link.rsp. Limits given here go before those of the scene's [budget].
cmake_minimum_required(VERSION 3.25)

file(READ ${FOLDER}/report.json report)

# limit(<variable> <key of [budget]>): the caller's, else the scene's, else empty; `named` tells which.
function(limit out key)
  set(value "${${out}}")
  set(named "the image's budget ${out}")
  if(value STREQUAL "")
    string(JSON value ERROR_VARIABLE missing GET "${report}" budget ${key})
    set(named "[budget] ${key}")
    if(missing)
      set(value "")
    endif()
  endif()
  set(${out}_limit "${value}" PARENT_SCOPE)
  set(${out}_named "${named}" PARENT_SCOPE)
endfunction()
set(CODE_limit "${CODE}")  # [budget] has no key for code
set(CODE_named "the image's budget CODE")
limit(CONST constants_bytes)
limit(STATE state_bytes)
limit(STACK stack_bytes)

set(HAPTIC_IMAGE_ASSERTS "")
function(add_assert region what limit named)
  if(NOT limit STREQUAL "")
    set(HAPTIC_IMAGE_ASSERTS "${HAPTIC_IMAGE_ASSERTS}ASSERT(haptic_rt_${region}_used - haptic_rt_${region}_begin <= ${limit},
       \"image budget: ${what} exceeds ${named} = ${limit}\")\n" PARENT_SCOPE)
  endif()
endfunction()
add_assert(text "code of the core" "${CODE_limit}" "${CODE_named}")
add_assert(const "size of constants and scene" "${CONST_limit}" "${CONST_named}")
add_assert(state "state of the core" "${STATE_limit}" "${STATE_named}")
configure_file(${TEMPLATES}/image_budget.ld.in ${FOLDER}/budget.ld @ONLY)

set(stack "${STACK_limit}")
if(stack STREQUAL "")
  set(stack ${DEFAULT_STACK})
endif()
file(CONFIGURE OUTPUT ${FOLDER}/link.rsp CONTENT "--defsym=haptic_stack_bytes=${stack}\n" @ONLY)
file(CONFIGURE OUTPUT ${FOLDER}/stack_limit.txt CONTENT "${stack}" @ONLY)

set(HAPTIC_STATE_BYTES "${STATE_BYTES}")
if(PROGRAM)
  execute_process(COMMAND ${PROGRAM} OUTPUT_VARIABLE HAPTIC_STATE_BYTES RESULT_VARIABLE code ERROR_VARIABLE errors
    OUTPUT_STRIP_TRAILING_WHITESPACE)
  if(code)
    message(FATAL_ERROR "image: ${PROGRAM} ended with '${code}': ${errors}")
  endif()
endif()
configure_file(${TEMPLATES}/image_state.S.in ${FOLDER}/state.S @ONLY)
