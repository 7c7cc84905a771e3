// SPDX-License-Identifier: Apache-2.0
#include "host_sim/report/failure_log.hpp"

#include <cstdio>

#include "host_sim/report/part_report.hpp"

namespace haptic::sim {

void FailureLog::add(const std::string& kind, const std::string& text) {
  std::vector<std::string>& kept = kinds_[kind];
  if (kept.size() < kKeptPerKind) kept.push_back(text);
}

void FailureLog::add(const FailureLog& other) {
  for (const auto& [kind, texts] : other.kinds_) {
    for (const std::string& text : texts) add(kind, text);
  }
}

std::vector<std::string> FailureLog::lines() const {
  std::vector<std::string> lines;
  for (const auto& [kind, texts] : kinds_) {
    for (const std::string& text : texts) lines.push_back(kind + ": " + text);
  }
  return lines;
}

std::string number_text(Wide value) {
  char text[48];
  std::snprintf(text, sizeof text, "%.5Lg", value);
  return text;
}

std::string failure_text(const std::string& pair, const Pose& pose_wa, const std::string& defect) {
  std::string text = pair + " at p = (";
  const auto append = [&](Real value, const char* after) {
    append_number(text, static_cast<double>(value));
    text += after;
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

std::string tick_failure_text(const std::string& run, std::uint64_t tick, const Pose& part_wa,
                              const Pose& goal_wa, const std::string& defect) {
  return failure_text(run + ", tick " + std::to_string(tick) + ", part", part_wa,
                      failure_text("goal", goal_wa, defect));
}

}  // namespace haptic::sim
