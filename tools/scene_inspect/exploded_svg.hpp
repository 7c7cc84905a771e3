// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The exploded view as a drawing: every body in its own panel, seen isometrically with z upward,
/// faces inside a part hatched, a legend with the numbers of the pieces, a scale.

#include <string>
#include <vector>

#include "tools/scene_inspect/exploded_view.hpp"

namespace haptic::tools {

/// SVG 1.1, self-contained; the same bytes for the same scene. `factor` is stated in the caption.
std::string exploded_svg(const std::string& scene, const std::vector<ExplodedBody>& bodies,
                         double factor);

}  // namespace haptic::tools
