// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Messages of failed checks: the pose in numbers that read back as themselves, so that the case
/// can be run again, and what was wrong there.

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "host_sim/oracle/wide.hpp"
#include "rt_core/base/pose.hpp"

namespace haptic::sim {

/// The first few failures of each kind.
class FailureLog {
 public:
  static constexpr std::size_t kKeptPerKind = 4;

  /// `kind`: a few words without numbers.
  void add(const std::string& kind, const std::string& text);
  /// Appends what another part of the run has kept, in its order.
  void add(const FailureLog& other);

  [[nodiscard]] bool empty() const { return kinds_.empty(); }
  /// "kind: text", by kind.
  [[nodiscard]] std::vector<std::string> lines() const;

 private:
  std::map<std::string, std::vector<std::string>> kinds_;
};

/// Five significant digits.
[[nodiscard]] std::string number_text(Wide value);

/// "pair at p = (x, y, z), q wxyz = (w, x, y, z): defect", 17 digits.
[[nodiscard]] std::string failure_text(const std::string& pair, const Pose& pose_wa,
                                       const std::string& defect);

/// "run, tick N, part at p = ..: goal at p = ..: defect".
[[nodiscard]] std::string tick_failure_text(const std::string& run, std::uint64_t tick,
                                            const Pose& part_wa, const Pose& goal_wa,
                                            const std::string& defect);

}  // namespace haptic::sim
