# SPDX-License-Identifier: Apache-2.0
# Rule: functions, structures, numbers and their layout are those of the stored interface of this soname. A library that is
# made of nothing but the header is compared with it; exported_symbols.cmake says that the true one has the same functions.
# cmake -DHEADER=<haptic.h> -DMAP=<haptic.map> -DREFERENCE=<interface_0.abi> -DC_COMPILER=<cc> -DFOLDER=<work>
#       [-DABIDIFF=<abidiff>] [-DFROM=<text> -DTO=<text>] [-DRENEW=<abidw>] -P interface.cmake
# FROM, TO: a change of the header. RENEW: writes REFERENCE.
cmake_minimum_required(VERSION 3.25)

if(NOT ABIDIFF AND NOT RENEW)
  message("skipped: no abidiff; on Debian: apt-get install abigail-tools")
  return()
endif()
file(REMOVE_RECURSE ${FOLDER})
file(READ ${HEADER} text)
if(FROM)
  string(FIND "${text}" "${FROM}" at)
  if(at LESS 0)
    message(FATAL_ERROR "interface: the header has no '${FROM}' to change")
  endif()
  string(REPLACE "${FROM}" "${TO}" text "${text}")
endif()
file(WRITE ${FOLDER}/haptic.h "${text}")
string(REGEX MATCHALL "\nHAPTIC_API [^;]*" declarations "${text}")
set(functions "#include <haptic.h>\n")
foreach(declaration IN LISTS declarations)
  string(REGEX REPLACE "^\nHAPTIC_API " "" declaration "${declaration}")
  string(APPEND functions "${declaration} { return 0; }\n")
endforeach()
# Functions take enumerators as int; a function for each enumeration keeps its numbers in the comparison.
string(REGEX MATCHALL "\ntypedef enum [a-z_]+" enumerations "${text}")
foreach(enumeration IN LISTS enumerations)
  string(REGEX REPLACE "^\ntypedef enum " "" name "${enumeration}")
  string(APPEND functions "int haptic_numbers_of_${name}(${name} x) { return (int)x; }\n")
endforeach()
file(WRITE ${FOLDER}/functions.c "${functions}")
execute_process(COMMAND ${C_COMPILER} -std=c99 -g -shared -fPIC -I. functions.c
  -Wl,--version-script=${MAP} -Wl,-soname,libhaptic.so.0 -o libhaptic.so WORKING_DIRECTORY ${FOLDER}
  COMMAND_ERROR_IS_FATAL ANY)
if(RENEW)
  execute_process(COMMAND ${RENEW} --no-comp-dir-path --no-corpus-path --drop-private-types --no-show-locs
    ${FOLDER}/libhaptic.so OUTPUT_FILE ${REFERENCE} COMMAND_ERROR_IS_FATAL ANY)
  return()
endif()
execute_process(COMMAND ${ABIDIFF} ${REFERENCE} ${FOLDER}/libhaptic.so OUTPUT_VARIABLE difference ERROR_VARIABLE difference
  RESULT_VARIABLE code)
if(code OR NOT difference STREQUAL "")
  message(FATAL_ERROR "interface: haptic.h and ${REFERENCE} differ; a program that was built before would not run\n"
    "${difference}\nA new soname, or before a release: cmake -DRENEW=abidw -DHEADER=${HEADER} -DMAP=${MAP} "
    "-DREFERENCE=${REFERENCE} -DC_COMPILER=${C_COMPILER} -DFOLDER=${FOLDER} -P ${CMAKE_CURRENT_LIST_FILE}")
endif()
list(LENGTH declarations count)
message("interface: ${count} functions and their types are those of ${REFERENCE}")
