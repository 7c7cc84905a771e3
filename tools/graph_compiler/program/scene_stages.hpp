// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The order of an assembly in its compiled scene, and the guides along the plans of its stages.

#include <cstddef>
#include <string>
#include <vector>

#include "tools/graph_compiler/program/compile_scene.hpp"
#include "tools/graph_compiler/program/plausible_values.hpp"

namespace haptic::tools {

/// In a scene whose parts are given assembled: makes their places the goals of stages, in their
/// order, and lays the parts that may be held on a ring about the assembly, at the height of its
/// middle, each where it is nearest. `balls`: of all parts by number, assembled. @return a note for
/// people.
std::string lay_apart(SceneFile& scene, const std::vector<PartBall>& balls);

/// Adds the stages of the scene file to the compiled scene, which has its parts. Each plan is
/// proved again in the scene of its stage, and must lead from the part's start to its goal.
/// @throws InputError as make_guide; where a plan leads elsewhere.
void add_stages(CompiledScene& compiled);

/// In place of the scene that of its stage `number`, from 1, with one moving part, and of the parts
/// those that are in it. @throws InputError where there is no such stage.
void take_stage(CompiledScene& compiled, std::size_t number);

}  // namespace haptic::tools
