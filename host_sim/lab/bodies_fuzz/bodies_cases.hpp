// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The cases of the campaign against several moving bodies, each in several shapes.

#include <string>
#include <vector>

#include "host_sim/lab/bodies_fuzz/bodies_scene.hpp"

namespace haptic::sim {

/// "driver", "hands", "three", "assembly".
[[nodiscard]] const std::vector<std::string>& bodies_case_names();

/// Scenes of the cases of these names, in the order of bodies_case_names(); of all where none is
/// named.
[[nodiscard]] std::vector<BodiesScene> bodies_scenes(const std::vector<std::string>& names);

}  // namespace haptic::sim
