// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The arm of a robot description (URDF), from a base link to the link that the hand holds.

#include <filesystem>
#include <string>
#include <vector>

#include "tools/bridges/arm/arm_model.hpp"

namespace haptic::tools {

struct ArmDescription {
  ArmModel model;                        ///< B is the base link's frame, D is B
  std::vector<std::string> joint_names;  ///< from the base to the handle
  double mass_kg = 0;                    ///< of all that the joints carry; 0: it states none
};

/// False in a build without tinyxml2; then the two below refuse everything and say so.
[[nodiscard]] bool can_read_arms();

/// Joints between the two links may be fixed, revolute (with limits) or continuous. All other
/// joints, those of a gripper, stand at 0, and what hangs on them is carried by the arm's.
/// @throws InputError "file:line: defect; fix": no such link, no way between the two, another kind
///         of joint, a joint that mimics, no axis, no limits, a mass below 0, more than kMaxJoints.
[[nodiscard]] ArmDescription read_arm(const std::filesystem::path& urdf, const std::string& base,
                                      const std::string& tip);

/// The same from text.
[[nodiscard]] ArmDescription arm_of(const std::string& text, const std::string& file,
                                    const std::string& base, const std::string& tip);

}  // namespace haptic::tools
