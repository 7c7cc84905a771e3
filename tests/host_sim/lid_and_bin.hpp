// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Assemblies of two parts of many convex pieces, drawn from a seed: a bevelled lid and a bin with
/// a rim, and the motion of a hand that sets the lid down askew, seats it, slides, turns and tilts
/// it, presses deep and lifts it off. Each part is a closed profile swept round an outline, which
/// may be a rectangle, one with cut corners, a regular polygon or an L.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "host_sim/session/motion_script.hpp"
#include "tools/graph_compiler/program/scene_file.hpp"

namespace haptic::sim::test {

enum class Outline { kRectangle, kOctagon, kPolygon, kEll };
enum class LidForm {
  kPlug,  ///< a plate with a bevelled plug that goes into the bin
  kStep,  ///< the same with a step in the plug and one on the plate
  kCap,   ///< a plate with a skirt round the rim
  kBoth   ///< a skirt round the rim and a ring inside
};

struct LidAndBin {
  std::string name;        ///< outline, form, seed
  tools::SceneFile scene;  ///< default options; its meshes lie in the folder given
  MotionScript motion;     ///< 4 s at 1 kHz
};

/// Writes the two meshes into `folder`. The same arguments give the same assembly.
[[nodiscard]] LidAndBin make_lid_and_bin(const std::filesystem::path& folder, Outline outline,
                                         LidForm form, std::uint64_t seed);

}  // namespace haptic::sim::test
