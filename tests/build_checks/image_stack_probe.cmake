# SPDX-License-Identifier: Apache-2.0
# Holds an image's core to a stack of STACK bytes.
# cmake -DOBJECTS=<objects of the core> -DIMAGE=<folder for the output> -DSTACK=<bytes> -P image_stack_probe.cmake
cmake_minimum_required(VERSION 3.25)

file(WRITE ${IMAGE}/stack_limit.txt "${STACK}")
include(${CMAKE_CURRENT_LIST_DIR}/../../linker/image_stack.cmake)
