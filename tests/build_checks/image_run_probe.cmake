# SPDX-License-Identifier: Apache-2.0
# Links an image with what does not belong to it and runs it; its verdict is the message.
# cmake -DLINK=<compiler|options|objects> -DPROGRAM=<output> -P image_run_probe.cmake
cmake_minimum_required(VERSION 3.25)

string(REPLACE "|" ";" link "${LINK}")
execute_process(COMMAND ${link} -o ${PROGRAM} COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${PROGRAM} OUTPUT_VARIABLE output RESULT_VARIABLE code)
if(code)
  message(FATAL_ERROR "image: ended with '${code}': ${output}")
endif()
