// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The coupling of a scene, once the size of its moving part is known: what the scene file gives,
/// and for the rest gains bounded by the device first, then by the length L, then by accuracy.

#include <string>
#include <vector>

#include "tools/graph_compiler/program/scene_file.hpp"

namespace haptic::tools {

struct CouplingChoice {
  CouplingParameters coupling{};
  std::vector<std::string> notes;  ///< a sentence for every gain that the device reduced
};

/// @param radius_m  of the moving part about its grip point.
/// @throws InputError with the place of a gain that the file gives and the device cannot hold,
/// unless it allows active gains.
CouplingChoice choose_coupling(const SceneFile& scene, double radius_m);

}  // namespace haptic::tools
