# SPDX-License-Identifier: Apache-2.0
# Rule: the C++ example of the README compiles against the core.
# cmake -DREADME=<file> -DROOT=<project> -DCOMPILER=.. -DDEFINITIONS=a|b -DEIGEN=<folder> -DFOLDER=<output>
#       -P readme_example.cmake
cmake_minimum_required(VERSION 3.25)
file(READ ${README} text)
string(FIND "${text}" "```cpp\n" begin)
if(begin LESS 0)
  message(FATAL_ERROR "readme example: no C++ example in ${README}")
endif()
math(EXPR begin "${begin} + 7")
string(SUBSTRING "${text}" ${begin} -1 text)
string(FIND "${text}" "```" end)
string(SUBSTRING "${text}" 0 ${end} text)
file(WRITE ${FOLDER}/readme_example.cpp "${text}")
string(REPLACE "|" ";" definitions "${DEFINITIONS}")
list(REMOVE_ITEM definitions "")
list(TRANSFORM definitions PREPEND -D)
execute_process(COMMAND ${COMPILER} -std=c++20 -fsyntax-only -Wall -Wextra -Werror -I${ROOT} -isystem ${EIGEN}
  ${definitions} ${FOLDER}/readme_example.cpp RESULT_VARIABLE code)
if(code)
  message(FATAL_ERROR "readme example: the C++ example of ${README} does not compile")
endif()
message("readme example: compiles")
