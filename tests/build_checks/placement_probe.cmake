# SPDX-License-Identifier: Apache-2.0
# Links the hosted program with one object of the core taken out of the archive, then checks its placement.
# cmake -DLINK=<compiler|options|objects> -DARCHIVE=.. -DLOOSE=<member> -DAR=.. -DNM=.. -DFOLDER=.. -P placement_probe.cmake
cmake_minimum_required(VERSION 3.25)

file(MAKE_DIRECTORY ${FOLDER})
execute_process(COMMAND ${AR} x ${ARCHIVE} ${LOOSE} WORKING_DIRECTORY ${FOLDER} COMMAND_ERROR_IS_FATAL ANY)
string(REPLACE "|" ";" link "${LINK}")
execute_process(COMMAND ${link} ${FOLDER}/${LOOSE} ${ARCHIVE} -o ${FOLDER}/program COMMAND_ERROR_IS_FATAL ANY)
set(PROGRAM ${FOLDER}/program)
include(${CMAKE_CURRENT_LIST_DIR}/placement.cmake)
