# SPDX-License-Identifier: Apache-2.0
# Compiles rt_core/scene with a changed header of traits, links it before an image's core and asks for the state.
# cmake -DHEADER=<scene_image.hpp> -DFROM=<regex> -DTO=<text> -DFOLDER=.. -DCOMPILER=.. -DFLAGS=a|b -DROOT=<project>
#   -DEIGEN=<include folder> -DREAL_IS_FLOAT=0|1 -DARCHIVE=<core> -DOBJECTS=a|b -P image_traits_probe.cmake
cmake_minimum_required(VERSION 3.25)

file(REMOVE_RECURSE ${FOLDER})
file(READ ${HEADER} header)
string(REGEX REPLACE "${FROM}" "${TO}" changed "${header}")
if(changed STREQUAL header)
  message(FATAL_ERROR "traits: '${FROM}' is not in ${HEADER}")
endif()
file(WRITE ${FOLDER}/rt_core/scene/scene_image.hpp "${changed}")
string(REPLACE "|" ";" flags "${FLAGS}")
list(REMOVE_ITEM flags "")
string(REPLACE "|" ";" objects "${OBJECTS}")
file(GLOB sources ${ROOT}/rt_core/scene/*.cpp)
list(TRANSFORM sources REPLACE "(.+)" "#include \"\\1\"\n")
list(JOIN sources "" text)
file(WRITE ${FOLDER}/scene.cpp "${text}")
execute_process(COMMAND ${COMPILER} ${flags} -DHAPTIC_SCENE_IMAGE=1 -DEIGEN_DONT_VECTORIZE -DEIGEN_NO_DEBUG
  -DHAPTIC_REAL_IS_FLOAT=${REAL_IS_FLOAT} -I${FOLDER} -I${ROOT} -isystem${EIGEN} -c ${FOLDER}/scene.cpp
  -O0 -U_FORTIFY_SOURCE -o ${FOLDER}/scene.o COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${COMPILER} ${objects} ${FOLDER}/scene.o ${ARCHIVE} -o ${FOLDER}/state_size
  COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${FOLDER}/state_size RESULT_VARIABLE code ERROR_VARIABLE errors)
if(code)
  message(FATAL_ERROR "traits: ended with '${code}': ${errors}")
endif()
