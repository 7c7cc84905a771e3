# SPDX-License-Identifier: Apache-2.0
# Rules that read the sources; each probe is a tree of one file.
foreach(rule include_direction core_words work_account licence_line top_level comment_first_word)
  haptic_build_check(${rule} ${CMAKE_COMMAND} -DROOT=${PROJECT_SOURCE_DIR} -P ${checks}/${rule}.cmake)
endforeach()

set(stated ${CMAKE_COMMAND} -DROOT=${PROJECT_SOURCE_DIR} -P ${checks}/stated_minutes.cmake)
haptic_build_check(stated_minutes ${CMAKE_COMMAND} -DREADME=${PROJECT_SOURCE_DIR}/README.md ${stated})
file(READ ${PROJECT_SOURCE_DIR}/README.md text)
string(REGEX REPLACE "(tools/quickstart +# about )[0-9]+" "\\199" text "${text}")
file(WRITE ${samples}/other_minutes.md "${text}")
haptic_build_probe(stated_minutes.probe_other "says 99 min for quickstart" ${CMAKE_COMMAND}
  -DREADME=${samples}/other_minutes.md ${stated})

haptic_build_check(compiled_once ${CMAKE_COMMAND} -DCOMMANDS=${PROJECT_BINARY_DIR}/compile_commands.json
  -P ${checks}/compiled_once.cmake)
file(WRITE ${samples}/compiled_twice.json "[
{
  \"command\": \"g++ -O1 -o a/one.o -c /p/one.cpp\",
  \"file\": \"/p/one.cpp\"
},
{
  \"command\": \"g++ -O1 -o b/one.o -c /p/one.cpp\",
  \"file\": \"/p/one.cpp\"
}
]
")
haptic_build_probe(compiled_once.probe_twice "/p/one.cpp: compiled twice with" ${CMAKE_COMMAND}
  -DCOMMANDS=${samples}/compiled_twice.json -P ${checks}/compiled_once.cmake)

set(embedding ${CMAKE_COMMAND} -DPROJECT=${checks}/probes/embedding -DROOT=${PROJECT_SOURCE_DIR}
  -DCOMPILER=${CMAKE_CXX_COMPILER})
haptic_build_check(embedding ${embedding} -DFOLDER=${samples}/embedding -P ${checks}/embedding.cmake)
haptic_build_probe(embedding.probe_leak "own.cpp is compiled with -D" ${embedding} -DFOLDER=${samples}/embedding_leak
  -DLEAK=ON -P ${checks}/embedding.cmake)
haptic_build_check(embedding_fetched ${embedding} -DFOLDER=${samples}/embedding_fetched -DFETCH=ON
  -P ${checks}/embedding.cmake)
if(HAPTIC_BUILD_TOOLS)
  haptic_build_probe(embedding.probe_tools "is built" ${embedding} -DFOLDER=${samples}/embedding_tools -DTOOLS=ON
    -P ${checks}/embedding.cmake)
endif()

# A sixth and a seventh argument: a second file and its text.
function(haptic_tree_probe rule what path text expected)
  set(tree ${samples}/${rule}_${what})
  file(REMOVE_RECURSE ${tree})
  file(WRITE ${tree}/${path} "${text}\n")
  if(ARGC EQUAL 7)
    file(WRITE ${tree}/${ARGV5} "${ARGV6}\n")
  endif()
  haptic_build_probe(${rule}.probe_${what} "${expected}"
    ${CMAKE_COMMAND} -DROOT=${tree} -P ${checks}/${rule}.cmake)
endfunction()

haptic_tree_probe(include_direction base_to_law rt_core/base/pose.hpp "\n#include \"rt_core/law/paper_law.hpp\""
  "rt_core/base/pose.hpp:2: includes 'rt_core/law/paper_law.hpp'; rt_core/base may include rt_core/base/")
haptic_tree_probe(include_direction scene_to_contact rt_core/scene/a.cpp "#include \"rt_core/tracking/near_set.hpp\""
  "includes 'rt_core/tracking/near_set.hpp'; rt_core/scene may include")
haptic_tree_probe(include_direction exchange_to_scene rt_core/exchange/a.hpp "#include \"rt_core/scene/a.hpp\""
  "includes 'rt_core/scene/a.hpp'; rt_core/exchange may include")
haptic_tree_probe(include_direction core_to_hal rt_core/haptic_core.cpp "#include \"hal/device.hpp\""
  "includes 'hal/device.hpp'; rt_core may include rt_core/")
haptic_tree_probe(include_direction tracking_to_proxy rt_core/tracking/near_set.hpp "\n#include \"rt_core/proxy/valid_planes.hpp\""
  "rt_core/tracking/near_set.hpp:2: includes 'rt_core/proxy/valid_planes.hpp'; rt_core/tracking may include")
haptic_tree_probe(include_direction core_vector rt_core/contact/a.hpp "#include <vector>" "includes 'vector'; the core takes")
haptic_tree_probe(include_direction core_mutex rt_core/contact/a.hpp "# include <mutex>" "includes 'mutex'; the core takes")
haptic_tree_probe(include_direction core_dense rt_core/law/a.hpp "#include <Eigen/Dense>" "includes 'Eigen/Dense'; the core takes")
haptic_tree_probe(include_direction core_macro rt_core/law/a.hpp "#include CONFIG" "cannot be checked")
haptic_tree_probe(include_direction hal_to_tools hal/a.cpp "#include \"tools/common/error.hpp\""
  "includes 'tools/common/error.hpp'; hal may include rt_core/ hal/")
haptic_tree_probe(include_direction tools_to_hal tools/scene_inspect/main.cpp "#include \"hal/device.hpp\""
  "includes 'hal/device.hpp'; tools may include rt_core/ tools/")
haptic_tree_probe(include_direction sim_to_mesh host_sim/a.cpp "#include \"tools/graph_compiler/mesh/surface.hpp\""
  "includes 'tools/graph_compiler/mesh/surface.hpp'; host_sim may include")
haptic_tree_probe(include_direction up_and_over rt_core/base/a.hpp "#include \"rt_core/base/../law/a.hpp\""
  "includes 'rt_core/base/../law/a.hpp'; rt_core/base may include rt_core/base/")
haptic_tree_probe(include_direction not_from_root tools/common/a.cpp "#include \"error.hpp\""
  "write project headers from the root")

haptic_tree_probe(work_account set rt_core/proxy/a.cpp "tick.work.rejected = start.rejected;"
  "rt_core/proxy/a.cpp:1: 'work.rejected = start.rejected' overwrites the account")
haptic_tree_probe(work_account less rt_core/proxy/a.cpp "tick.work.regions -= 1;" "'work.regions -= 1' overwrites the account")
haptic_tree_probe(core_words dynamic rt_core/a.hpp "Eigen::Matrix<double, 3, Eigen::Dynamic> m;" "'Eigen::Dynamic'")
haptic_tree_probe(core_words matrix_x rt_core/a.hpp "MatrixXd m;" "'MatrixXd'")
haptic_tree_probe(core_words vector_x rt_core/a.hpp "Eigen::VectorXf v;" "'VectorXf'")
haptic_tree_probe(core_words std_vector rt_core/a.hpp "std::vector<int> v;" "'std::vector'")
haptic_tree_probe(core_words std_function rt_core/a.hpp "std::function<void()> f;" "'std::function'")
haptic_tree_probe(core_words throw rt_core/a.cpp "void f() { throw 1; }" "'throw'")

haptic_tree_probe(licence_line missing hal/a.cpp "int main() {}" "hal/a.cpp:1: first line is not")
haptic_tree_probe(licence_line second_line hal/a.hpp "#pragma once\n// SPDX-License-Identifier: Apache-2.0"
  "hal/a.hpp:1: first line is not")
haptic_tree_probe(licence_line other_licence linker/a.ld "/* SPDX-License-Identifier: MIT */" "linker/a.ld:1: first line")

haptic_tree_probe(top_level stray_folder utils/a.cpp "" "utils: not at the top level")
haptic_tree_probe(top_level stray_file notes.txt "" "notes.txt: not at the top level")

haptic_tree_probe(comment_first_word what hal/a.hpp "\n/// What it is.\nint a;"
  "1 comments begin with What, Whether or Of, and tests/build_checks/comment_first_word.txt allows 0")
haptic_tree_probe(comment_first_word whether rt_core/a.cpp "int a;  // Whether it is" "rt_core/a.cpp: int a")
haptic_tree_probe(comment_first_word of tools/a.cpp "int a;\n//  Of the last\n// Of all" "1 comments begin with")
# None of these comments begins so.
haptic_tree_probe(comment_first_word fewer host_sim/a.cpp
  "/// The place\n/// Of a part.\nint a;  ///< Often\n" "lower the figure in tests/build_checks/comment_first_word.txt from 7 to 0"
  tests/build_checks/comment_first_word.txt "7")

haptic_build_check(include_circles ${CMAKE_COMMAND} -DROOT=${PROJECT_SOURCE_DIR} -P ${checks}/include_circles.cmake)
haptic_build_check(references ${CMAKE_COMMAND} -DROOT=${PROJECT_SOURCE_DIR} -P ${checks}/references.cmake)
include(reference_probes.cmake)
