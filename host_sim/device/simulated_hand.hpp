// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The hand on the simulated device: a spring and a damper, in translation and in rotation, to a
/// target that moves, and a constant push. Its passive part is integrated together with the device
/// (axis_motion.hpp); here are its values and its target.

#include <optional>
#include <string>
#include <vector>

#include "host_sim/shapes/shapes.hpp"

namespace haptic::sim {

/// Lever at which the springs of a hand act in rotation: the fingers hold a handle of about this
/// radius, so the tissue that gives k and b in translation gives k L^2 and b L^2 in rotation [m].
inline constexpr double kGripRadius_m = 0.015;

struct HandModel {
  std::string name = "none";
  double stiffness_n_per_m = 0, damping_ns_per_m = 0;        ///< >= 0
  double stiffness_nm_per_rad = 0, damping_nms_per_rad = 0;  ///< >= 0
  Vector push_w = Vector::Zero();  ///< constant force in addition to the springs [N]
};

/// A hand of these values in translation, and k L^2, b L^2 in rotation.
[[nodiscard]] HandModel hand_of(const std::string& name, double stiffness_n_per_m,
                                double damping_ns_per_m);

/// "none" (nobody holds the device), "loose" 100 N/m, 0.2 N s/m; "light" 300, 3; "firm" 800, 10.
/// Nothing for any other name.
[[nodiscard]] std::optional<HandModel> hand_named(const std::string& name);
[[nodiscard]] const std::vector<std::string>& hand_names();

/// Where the hand wants the grip point and the part's orientation, at one instant.
struct HandTarget {
  Vector x0_w = Vector::Zero();
  Rotation q_wa = Rotation::Identity();
};

/// Targets at both ends of a period; between them it moves at constant speed.
struct HandStroke {
  HandTarget from, to;
};

}  // namespace haptic::sim
