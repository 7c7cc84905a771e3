// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The driven parts of a run, and the part of a second hand, for pages, viewers and MCAP: what they
/// were given before each tick, and where they were after it.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "rt_core/bodies/driven_parts.hpp"
#include "tools/live/driven_tick.hpp"
#include "tools/live/page_file.hpp"

namespace haptic::sim {

/// Owner: the thread of the loop. Without one of them it keeps nothing.
class DriveTape {
 public:
  /// `keeps_states`: of the whole run; else of the last tick alone.
  explicit DriveTape(bool keeps_states) : keeps_states_(keeps_states) {}

  /// Before a tick of the hand; of the same number as the calls of it so far. `second`: the pose
  /// that a second hand gives; null: there is none.
  void give(const DrivenInput& input, const Pose* second = nullptr);
  /// After it; `second`: of the second hand.
  void take(const DrivenParts& parts, const StepResult* second = nullptr);

  /// Poses that were new in the last tick.
  [[nodiscard]] std::span<const tools::GivenPose> newest() const;
  /// The driven parts after the last tick.
  [[nodiscard]] std::span<const tools::DrivenTick> now() const;

  /// `tick`, of that number, as the page computes it with the driven parts.
  void mark(tools::RecordedTick& tick, std::size_t number) const;

  /// The run's, ordered by part, then by tick: what changes little from one to the next is small.
  [[nodiscard]] std::vector<tools::GivenPose> given() const;
  /// The run's, one tick after the other, where they are kept.
  [[nodiscard]] std::span<const tools::DrivenTick> states() const { return states_; }

 private:
  struct Clock {
    std::int64_t now_ns = 0;
    bool is_felt = true;
  };

  bool keeps_states_;
  std::vector<tools::GivenPose> given_;  ///< ordered by tick
  std::vector<Clock> clocks_;            ///< of each tick
  std::vector<tools::DrivenTick> states_;
  std::array<std::uint64_t, kMostDriven> numbers_{};  ///< of the newest poses
  std::size_t newest_begin_ = 0, now_begin_ = 0;
};

}  // namespace haptic::sim
