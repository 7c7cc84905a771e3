// SPDX-License-Identifier: Apache-2.0
#include "host_sim/device/simulated_hand.hpp"

namespace haptic::sim {

HandModel hand_of(const std::string& name, double stiffness_n_per_m, double damping_ns_per_m) {
  constexpr double kLever = kGripRadius_m * kGripRadius_m;
  HandModel hand;
  hand.name = name;
  hand.stiffness_n_per_m = stiffness_n_per_m;
  hand.damping_ns_per_m = damping_ns_per_m;
  hand.stiffness_nm_per_rad = kLever * stiffness_n_per_m;
  hand.damping_nms_per_rad = kLever * damping_ns_per_m;
  return hand;
}

std::optional<HandModel> hand_named(const std::string& name) {
  if (name == "none") return hand_of(name, 0, 0);
  if (name == "loose") return hand_of(name, 100, 0.2);
  if (name == "light") return hand_of(name, 300, 3);
  if (name == "firm") return hand_of(name, 800, 10);
  return std::nullopt;
}

const std::vector<std::string>& hand_names() {
  static const std::vector<std::string> names = {"none", "loose", "light", "firm"};
  return names;
}

}  // namespace haptic::sim
