// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Numbers of a scene file that are allowed and can hardly be meant: by their size they are of
/// another unit. And a start or a grip that is far from everything.

#include <toml++/toml.h>
#include <string>
#include <vector>

#include "tools/graph_compiler/program/scene_file.hpp"

namespace haptic::tools {

/// A sentence for each number of `root` that lies outside of what people and devices have, with
/// its place: "scene.toml:12:5: [moving] mass_kg is 250: ..". Empty in the ordinary case.
[[nodiscard]] std::vector<std::string> implausible_values(const toml::table& root,
                                                          const std::string& file);

/// A ball about a part where it starts, in W [m].
struct PartBall {
  std::string name;
  std::array<double, 3> middle_m{0, 0, 0};
  double radius_m = 0;
};

/// The warning if the moving part starts so far from all fixed parts that a unit may be wrong; else
/// empty.
[[nodiscard]] std::string far_start_text(const PartBall& moving,
                                         const std::vector<PartBall>& fixed);

/// The warning if a part is too small for a hand or too large for a table; else empty.
[[nodiscard]] std::string odd_size_text(double diagonal_m);

/// The warning if the grip point is far outside of the part; else empty. `farthest_m`: the distance
/// of its farthest corner from there; `diagonal_m`: the size of the part.
[[nodiscard]] std::string far_grip_text(double farthest_m, double diagonal_m);

}  // namespace haptic::tools
