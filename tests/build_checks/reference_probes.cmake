# SPDX-License-Identifier: Apache-2.0
# Probes of the rules include_circles and references: small trees that each must refuse.

# haptic_trees_probe(<rule> <what> <text expected> <path> <content> [<path> <content>]..)
function(haptic_trees_probe rule what expected)
  set(tree ${samples}/${rule}_${what})
  file(REMOVE_RECURSE ${tree})
  set(rest ${ARGN})
  while(rest)
    list(POP_FRONT rest path content)
    file(WRITE ${tree}/${path} "${content}\n")
  endwhile()
  haptic_build_probe(${rule}.probe_${what} "${expected}" ${CMAKE_COMMAND} -DROOT=${tree} -P ${checks}/${rule}.cmake)
endfunction()

haptic_trees_probe(include_circles sub_folders "circle host_sim/lab/timing -> host_sim/session -> host_sim/lab/wcet -> host_sim/lab/timing"
  host_sim/session/a.hpp "#include \"host_sim/lab/wcet/b.hpp\""
  host_sim/lab/wcet/b.hpp "#include \"host_sim/lab/timing/c.hpp\""
  host_sim/lab/timing/c.hpp "#include \"host_sim/session/a.hpp\"")
haptic_trees_probe(include_circles folder_and_its_own "circle rt_core -> rt_core/tick -> rt_core"
  rt_core/haptic_core.hpp "#include \"rt_core/tick/goal.hpp\""
  rt_core/tick/goal.hpp "#include \"rt_core/haptic_core.hpp\"")

set(method "\n# Method\n\n## 1. Bodies\n\n| 2 | rule |\n\n### 1.1 More\n\ntext")
haptic_trees_probe(references section "has no section 1.2" rt_core/METHOD.md "${method}"
  rt_core/contact/a.hpp "/// Distance (METHOD section 1.2).")
haptic_trees_probe(references wrapped_section "has no section 3" rt_core/METHOD.md "${method}"
  rt_core/contact/a.hpp "/// Distance (METHOD\n/// sections 1 and 3).")
haptic_trees_probe(references row "has no row 7" rt_core/METHOD.md "${method}"
  rt_core/contact/a.hpp "/// Distance (METHOD section 1, row 7).")
haptic_trees_probe(references document "no such document" rt_core/METHOD.md "${method}"
  hal/a.hpp "/// Distance (METHOD section 1).")
haptic_trees_probe(references absent "a document that is not in the tree" rt_core/METHOD.md "${method}"
  hal/a.hpp "/// Distance (decomposition\n/// section 3).")
haptic_trees_probe(references comment_file "names 'contact/near_sets.hpp'" rt_core/a.hpp "/// As in contact/near_sets.hpp.")
haptic_trees_probe(references text_file "names 'linker/IMAGE.md'" rt_core/a.cpp
  "const char* text = \"build an image (linker/IMAGE.md)\"\\;")
haptic_trees_probe(references link "link to 'b.md'" rt_core/README.md "See [this](b.md).")
haptic_trees_probe(references anchor "there is no such heading" rt_core/README.md "See [this](#limits).\n\n## Limit")
haptic_trees_probe(references function "rt_core/a.cpp has no 'step'" rt_core/a.cpp "void steps() {}"
  rt_core/README.md "It is `a.cpp:step`.")

# The C++ example of the README, and one that names a function that is not there.
set(readme_example ${CMAKE_COMMAND} -DROOT=${PROJECT_SOURCE_DIR} -DCOMPILER=${CMAKE_CXX_COMPILER}
  "-DDEFINITIONS=$<JOIN:$<TARGET_PROPERTY:rt_core,INTERFACE_COMPILE_DEFINITIONS>,|>" -DEIGEN=${EIGEN3_INCLUDE_DIR})
haptic_build_check(readme_example ${readme_example} -DREADME=${PROJECT_SOURCE_DIR}/README.md
  -DFOLDER=${samples}/readme_example -P ${checks}/readme_example.cmake)
file(WRITE ${samples}/readme_example_probe/README.md
  "```cpp\n#include \"rt_core/haptic_core.hpp\"\nauto tick(haptic::HapticCore& core) { return core.render({}); }\n```\n")
haptic_build_probe(readme_example.probe_other_name "does not compile" ${readme_example}
  -DREADME=${samples}/readme_example_probe/README.md -DFOLDER=${samples}/readme_example_probe
  -P ${checks}/readme_example.cmake)
