# SPDX-License-Identifier: Apache-2.0
# Links an image under a budget of 8 bytes for one region (CODE, CONST, STATE), or under one of the scene's (SCENE).
# cmake -DLINK=<compiler|options|objects> -DREPORT=<report.json> -DREGION=.. -DFOLDER=.. -DTEMPLATES=.. -P image_budget_probe.cmake
cmake_minimum_required(VERSION 3.25)

file(READ ${REPORT} report)
set(limit)
if(REGION STREQUAL "SCENE")
  string(JSON report SET "${report}" budget "{\"state_bytes\": 8}")
else()
  set(limit -D${REGION}=8)
endif()
file(WRITE ${FOLDER}/report.json "${report}")
execute_process(COMMAND ${CMAKE_COMMAND} -DFOLDER=${FOLDER} -DTEMPLATES=${TEMPLATES} -DSTATE_BYTES=64 ${limit}
  -DDEFAULT_STACK=32768 -P ${TEMPLATES}/image_files.cmake COMMAND_ERROR_IS_FATAL ANY)
string(REPLACE "|" ";" link "${LINK}")
execute_process(COMMAND ${link} ${FOLDER}/budget.ld -o ${FOLDER}/program COMMAND_ERROR_IS_FATAL ANY)
