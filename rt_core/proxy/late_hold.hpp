// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What is felt while the part is late: a tick that ends on its budget leaves the proxy where it is
/// while the goal goes on, and the spring between them would wind up by what nothing holds.

#include <cstdint>

#include "rt_core/law/coupling.hpp"

namespace haptic {

/// What a tick of the proxy says of the pull that it leaves.
struct LeftPull {
  PoseError error;     ///< of the goal against the proxy
  Real held_m = 0;     ///< of its translation, what the planes of the last program hold
  Real open_n = 0;     ///< what they leave open and the proxy has not followed
  bool spent = false;  ///< the tick has ended on its budget
  bool moved = false;  ///< the proxy is not where it was
};

/// Holds the stretch of the spring that is felt, from the first tick that ended on its budget until
/// the spring's own is felt again. The direction is the spring's. The length does not grow while
/// the part is late, but for what the planes that are known hold, and then by no more in a tick
/// than a rationed release lets go of; a shorter one is felt at once. A part that has not moved for
/// long while it is late feels what its spring has, by the same ration.
class LateHold {
 public:
  void reset() noexcept { *this = LateHold{}; }
  /// The error that is felt. `radius_m`: of the part. Cost: a copy; while it is late a few roots.
  [[nodiscard]] PoseError felt(const LeftPull& pull, const Spring& spring, Real radius_m) noexcept;
  /// True if the last one was shorter than the spring's.
  [[nodiscard]] bool holds() const noexcept { return holds_; }

 private:
  bool late_ = false;  ///< since the budget was spent the spring's stretch has not been felt again
  bool holds_ = false;
  std::uint32_t since_spent_ = 0, still_ticks_ = 0;
  /// Lengths of the error that was felt last: their squares where that was the spring's.
  Real felt_m_ = 0, felt_rad_ = 0;
};

}  // namespace haptic
