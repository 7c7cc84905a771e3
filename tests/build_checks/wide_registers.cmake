# SPDX-License-Identifier: Apache-2.0
# Rule: the core that is compiled for 256-bit registers uses them, so that the test of its bits means something.
# cmake -DARCHIVE=<librt_core_wide.a> -DOBJDUMP=<objdump> -DSKIP=<reason or empty> -P wide_registers.cmake
cmake_minimum_required(VERSION 3.25)
if(SKIP)
  message("skipped: ${SKIP}")
  return()
endif()
execute_process(COMMAND ${OBJDUMP} -d --no-show-raw-insn ${ARCHIVE} OUTPUT_VARIABLE code RESULT_VARIABLE failed)
if(failed)
  message(FATAL_ERROR "wide registers: ${OBJDUMP} cannot read ${ARCHIVE}")
endif()
string(REGEX MATCHALL "v(mul|add|cmp)[a-z_]*p[ds][^\n]*ymm" uses "${code}")
list(LENGTH uses count)
if(count LESS 10)
  message(FATAL_ERROR "wide registers: no 256-bit register in ${ARCHIVE} (${count} instructions)")
endif()
message("wide registers: ${count} instructions on 256-bit registers")
