# SPDX-License-Identifier: Apache-2.0
# Runs a script or a notebook with the package on its path; says `skipped` where numpy is missing.
# cmake -DPYTHON=<python3> -DSCRIPT=<file> -DPACKAGE=<folder> -DLIBRARY=<libhaptic.so> [-DHOST_SIM=..]
#       [-DBATCH_PROGRAM=..] [-DVERSION=..] [-DTRIES=..] -P run_python.cmake
cmake_minimum_required(VERSION 3.25)

if(NOT PYTHON)
  message("skipped: no python3")
  return()
endif()
execute_process(COMMAND ${PYTHON} -c "import numpy" RESULT_VARIABLE code OUTPUT_QUIET ERROR_QUIET)
if(code)
  message("skipped: ${PYTHON} has no numpy; on Debian: apt-get install python3-numpy")
  return()
endif()
if(SCRIPT MATCHES "\\.ipynb$")
  list(PREPEND SCRIPT ${CMAKE_CURRENT_LIST_DIR}/run_notebook.py)
endif()
# A session in real time is tried again where the machine was too busy for it: TRIES times, 1 if not given.
if(NOT TRIES)
  set(TRIES 1)
endif()
foreach(try RANGE 1 ${TRIES})
  execute_process(COMMAND ${CMAKE_COMMAND} -E env PYTHONPATH=${PACKAGE} PYTHONDONTWRITEBYTECODE=1 HAPTIC_LIBRARY=${LIBRARY}
    HAPTIC_HOST_SIM=${HOST_SIM} HAPTIC_BATCH_PROGRAM=${BATCH_PROGRAM} HAPTIC_VERSION=${VERSION} ${PYTHON} -W error ${SCRIPT}
    RESULT_VARIABLE code)
  if(code EQUAL 0)
    return()
  endif()
  message("try ${try} of ${TRIES}: ${code}")
endforeach()
message(FATAL_ERROR "${SCRIPT} failed")
