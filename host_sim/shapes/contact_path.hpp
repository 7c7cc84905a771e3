// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Smooth motions of one body in contact with another on which the published law jumps
/// (rt_core/METHOD.md section 8): the contact region changes while depth and force hardly do.

#include <functional>
#include <string>
#include <vector>

#include "host_sim/shapes/shapes.hpp"

namespace haptic::sim {

/// Stiffness and depth of the paths: 1 N on a single face.
inline constexpr double kPathStiffness_n_per_m = 1000.0;
inline constexpr double kPathDepth_m = 0.001;
/// Width of the near set and reach of a contact outside its features on the paths.
inline constexpr double kPathEpsilon_m = 0.0005;

/// Where A stands on a path, in W; B stands at the origin.
struct PathPose {
  Vector p = Vector::Zero();  ///< [m]
  Rotation q = Rotation::Identity();
};

struct ContactPath {
  std::string name;   ///< for files: letters and underscores
  std::string title;  ///< what happens on it
  Solid a, b;
  std::function<PathPose(double)> pose;  ///< smooth in the parameter, 0 to 1
  /// So many steps are fine enough for the change per step to fall as the step does: contacts then
  /// take ten steps or more to come and go.
  std::uint32_t fine_steps = 4000;
};

/// The six paths, cubes of 0.1 m: an edge and a face that roll through parallel, flat faces with pi
/// leaving H, yaw of flat faces, a general motion, and the way over an edge of the C-obstacle. All
/// but the last keep D_near at -kPathDepth_m.
[[nodiscard]] std::vector<ContactPath> contact_paths();

/// Height z of A's origin at which D_near of A over B is -depth_m for the given orientation and
/// place; the upper one. Closed form: every face normal and every product of two edges bounds z,
/// and those that carry a C-face are among them. Cost: normals times vertices. [m]
[[nodiscard]] double height_at_depth(const Solid& a, const Solid& b, const Rotation& q, double x,
                                     double y, double depth_m);

}  // namespace haptic::sim
