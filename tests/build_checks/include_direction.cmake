# SPDX-License-Identifier: Apache-2.0
# Rule: includes point one way between the folders, and one way between the rooms of the core.
# cmake -DROOT=<project> -P include_direction.cmake
include(${CMAKE_CURRENT_LIST_DIR}/source_tree.cmake)

# Headers of the standard library that neither allocate nor lock nor do input and output.
set(core_headers algorithm array atomic bit cassert cfloat climits cmath compare concepts cstddef cstdint cstring
  initializer_list iterator limits new numbers numeric optional span string_view tuple type_traits utility version
  Eigen/Core Eigen/Geometry)

# Folder -> prefixes it may include. The longest folder that a file lies in decides.
set(may_rt_core rt_core/)
set(may_rt_core/base rt_core/base/)
set(may_rt_core/scene rt_core/base/ rt_core/scene/)
set(may_rt_core/contact rt_core/base/ rt_core/scene/ rt_core/contact/)
set(may_rt_core/tracking ${may_rt_core/contact} rt_core/tracking/)
set(may_rt_core/law ${may_rt_core/tracking} rt_core/law/)
set(may_rt_core/safety rt_core/base/ rt_core/safety/)
set(may_rt_core/proxy ${may_rt_core/law} rt_core/safety/ rt_core/proxy/)
set(may_rt_core/exchange rt_core/base/ rt_core/exchange/)
set(may_rt_core/tick ${may_rt_core/proxy} rt_core/tick/)
set(may_hal rt_core/ hal/)
set(may_tools rt_core/ tools/)
set(may_tools/run_device rt_core/ tools/ hal/)
set(may_tools/live rt_core/ tools/ hal/)
set(may_tools/library rt_core/ tools/ hal/)
# Compiled into the page's module too.
set(may_tools/verdict rt_core/ tools/verdict/)
set(may_tools/package rt_core/ hal/)
# Golden vectors and generated pairs are compiled by the one scene writer there is, and judged by the one budget of gains,
# hence the folders of tools.
set(may_host_sim rt_core/ hal/ host_sim/ tools/graph_compiler/graph/ tools/graph_compiler/coupling/ tools/c_space/ tools/plan/
  tools/live/ tools/verdict/ tools/common/)
# The campaigns on triangle meshes, and on puzzles for planners, compile their files as a user does.
set(may_host_sim/lab/acceptance rt_core/ hal/ host_sim/ tools/graph_compiler/ tools/common/)
set(may_host_sim/lab/planning rt_core/ hal/ host_sim/ tools/graph_compiler/ tools/c_space/ tools/plan/ tools/common/)
set(may_host_sim/lab/studies/planning rt_core/ hal/ host_sim/ tools/graph_compiler/ tools/c_space/ tools/plan/ tools/common/)
set(may_host_sim/lab/strangers rt_core/ hal/ host_sim/ tools/graph_compiler/ tools/common/)
set(may_host_sim/lab/surface_fuzz rt_core/ hal/ host_sim/ tools/graph_compiler/ tools/common/)
set(may_linker rt_core/ linker/)
set(may_tests rt_core/ hal/ tools/ host_sim/ tests/ linker/)

function(allowed_prefixes out folder_out path)
  get_filename_component(folder ${path} DIRECTORY)
  while(NOT DEFINED may_${folder})
    get_filename_component(folder ${folder} DIRECTORY)
  endwhile()
  set(${out} ${may_${folder}} PARENT_SCOPE)
  set(${folder_out} ${folder} PARENT_SCOPE)
endfunction()

function(check_include path quote target)
  allowed_prefixes(prefixes folder ${path})
  foreach(prefix IN LISTS prefixes)
    string(FIND "${target}" "${prefix}" at)
    if(at EQUAL 0 AND quote STREQUAL "\"" AND NOT target MATCHES "\\.\\.")
      return()
    endif()
  endforeach()
  string(REGEX REPLACE "/.*" "" first "${target}")
  if(quote STREQUAL "<" AND NOT first IN_LIST haptic_folders)
    if(NOT path MATCHES "^(rt_core|linker)/" OR target IN_LIST core_headers)
      return()
    endif()
    set(reason "the core takes Eigen/Core, Eigen/Geometry and standard headers that do not allocate, lock or print")
  elseif(first IN_LIST haptic_folders AND quote STREQUAL "\"")
    list(JOIN prefixes " " reason)
    set(reason "${folder} may include ${reason}")
  else()
    set(reason "write project headers from the root in quotes, others in angle brackets")
  endif()
  haptic_line_of(line ${path} "${target}")
  haptic_violation("${path}:${line}: includes '${target}'; ${reason}")
endfunction()

haptic_source_files(files "\\.(hpp|cpp|h|c|S|in|inc)$" ${haptic_folders})
list(FILTER files EXCLUDE REGEX "\\.ld\\.in$")
foreach(path IN LISTS files)
  file(STRINGS ${ROOT}/${path} lines REGEX "^[ \t]*#[ \t]*(include|import|include_next)[ \t]*[^ \t]")
  foreach(line IN LISTS lines)
    if(line MATCHES "^[ \t]*#[ \t]*include[ \t]*([<\"])([^>\"]+)[>\"]")
      check_include(${path} "${CMAKE_MATCH_1}" "${CMAKE_MATCH_2}")
    else()
      haptic_violation("${path}: '${line}' cannot be checked; name the header itself")
    endif()
  endforeach()
endforeach()
list(LENGTH files count)
haptic_report("include direction" ${count})
