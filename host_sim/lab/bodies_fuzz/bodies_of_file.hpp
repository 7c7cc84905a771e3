// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The bodies of a compiled scene whose parts move at once, as the campaign takes its own: shapes,
/// springs, drivers, loose parts, and the pairs that were compiled for them.

#include <string>

#include "host_sim/lab/bodies_fuzz/bodies_scene.hpp"

namespace haptic::sim {

/// Hands lead their parts all over what moves, and drivers theirs about their starts. A body is
/// seen from its grip point, which for a part that no hand holds is its middle.
/// @throws tools::InputError when the file cannot be read, and for a scene in which only one part
/// moves.
[[nodiscard]] CompiledBodies bodies_of_file(const std::string& path);

/// The largest coefficient of its pairs.
[[nodiscard]] double friction_of(const CompiledBodies& compiled);

}  // namespace haptic::sim
