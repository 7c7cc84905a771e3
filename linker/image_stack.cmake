# SPDX-License-Identifier: Apache-2.0
# Holds an image's core to its stack budget, by the rule of linker/stack_bound.cmake for the whole core.
# cmake -DOBJECTS=<objects of the core> -DIMAGE=<folder of the image> -P image_stack.cmake
cmake_minimum_required(VERSION 3.25)

file(READ ${IMAGE}/stack_limit.txt TOTAL)
set(FOLDER ${OBJECTS})
set(LIMIT 4096)
include(${CMAKE_CURRENT_LIST_DIR}/stack_bound.cmake)
file(WRITE ${IMAGE}/stack.txt "${deepest}\n")
