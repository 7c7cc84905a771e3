# SPDX-License-Identifier: Apache-2.0
# What strangers have brought, where it lies beside the project: each case as it should be.
# cmake -DSHARED=FOLDER -DPROGRAMS=FOLDER -P shared_cases.cmake
cmake_minimum_required(VERSION 3.25)
set(script "${SHARED}/cases/try_all.py")
if(NOT EXISTS "${script}")
  message("skipped: no cases in ${SHARED}")
  return()
endif()
find_program(python NAMES python3)
if(NOT python)
  message("skipped: no python3")
  return()
endif()
execute_process(COMMAND "${python}" "${script}" "${PROGRAMS}" OUTPUT_VARIABLE said ERROR_VARIABLE said RESULT_VARIABLE code)
message("${said}")
if(NOT code EQUAL 0 OR NOT said MATCHES "(^|\n)0 faults")
  message(FATAL_ERROR "a case is not as it should be")
endif()
