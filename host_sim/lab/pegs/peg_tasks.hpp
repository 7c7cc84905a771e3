// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Parts led into their holes as hands do it: aside, tilted, over the rim, then straightened,
/// pushed to the end and taken out again.

#include <cstdint>
#include <string>
#include <vector>

#include "host_sim/shapes/contact_path.hpp"
#include "tools/graph_compiler/graph/scene_writer.hpp"

namespace haptic::sim {

/// How the hand leads a part into its hole. All end straight.
struct PegWay {
  const char* name;
  double aside_share;  ///< of the part's half width, until the part is on its way in
  double tilt_rad;     ///< likewise
  double speed_m_per_s;
};

/// Where a part belongs: its pose when it is in, the direction in, and how deep.
struct PegSeat {
  PathPose in;
  Vector direction = -Vector::UnitZ();
  double depth_m = 0;
  double half_width_m = 0;
};

/// A part, its hole and one way of the hand into it.
struct PegTask {
  std::string name;  ///< for files: letters, digits, underscores
  tools::SceneDescription scene;
  double radius_m = 0;  ///< of the part about its grip point
  PegSeat seat;
  PegWay way;
};

/// Where the hand is at a time of the task; its last tick is outside and free.
[[nodiscard]] PathPose hand_of(const PegTask& task, double t_s);
[[nodiscard]] double duration_s(const PegTask& task);

/// Square, flat, twelve-sided, sixteen-sided and sixty-four-sided pegs, with 1, 0.1 and 0.01 mm of
/// clearance, and parts of a tenth and ten times the size. `quick`: few, for tests.
[[nodiscard]] std::vector<PegTask> peg_tasks(bool quick);

/// A hole of `sides` walls and a floor, its rim at z = 0, 40 mm deep times `scale`, and the prism
/// that fits with `clearance_m` all round. Each wall is one convex piece, and neighbours share
/// their planes to the last bit.
[[nodiscard]] std::vector<Solid> prism_hole(std::uint32_t sides, double half_width_m,
                                            double squeeze, double scale);

}  // namespace haptic::sim
