// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What a failed check says: the pose in numbers that read back as themselves, so that the case can
/// be run again, and what was wrong there.

#include <cstddef>
#include <cstdio>
#include <string>
#include <vector>

#include "host_sim/verification/verified_pair.hpp"

namespace haptic::sim {

/// Failures kept per set of checks.
inline constexpr std::size_t kKeptFailures = 8;

inline void keep_failure(std::vector<std::string>& failures, const std::string& text) {
  if (failures.size() < kKeptFailures) failures.push_back(text);
}

[[nodiscard]] inline std::string number_text(Wide value) {
  char text[48];
  std::snprintf(text, sizeof text, "%.4Lg", value);
  return text;
}

[[nodiscard]] inline std::string failure_text(const VerifiedPair& pair, const Pose& pose_wa,
                                              const std::string& defect) {
  const SceneView& view = pair.view();
  const auto& bodies = view.bodies();
  std::string text = std::string(view.text(bodies[0].name_offset, bodies[0].name_bytes)) + " on " +
                     std::string(view.text(bodies[1].name_offset, bodies[1].name_bytes)) +
                     " at p = (";
  const auto append = [&](Real value, const char* after) {
    char digits[40];
    std::snprintf(digits, sizeof digits, "%.17g%s", static_cast<double>(value), after);
    text += digits;
  };
  append(pose_wa.p_wa[0], ", ");
  append(pose_wa.p_wa[1], ", ");
  append(pose_wa.p_wa[2], "), q wxyz = (");
  append(pose_wa.q_wa.w(), ", ");
  append(pose_wa.q_wa.x(), ", ");
  append(pose_wa.q_wa.y(), ", ");
  append(pose_wa.q_wa.z(), "): ");
  return text + defect;
}

}  // namespace haptic::sim
