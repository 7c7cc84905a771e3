// SPDX-License-Identifier: Apache-2.0
#pragma once
/// All that happens in a run beside the hand's motion: its commands to hold and let go, the owners
/// of driven parts, and a tape of these for those who are shown the run.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host_sim/session/drive_run.hpp"
#include "host_sim/session/drive_tape.hpp"
#include "host_sim/session/hold_run.hpp"
#include "tools/live/live_state.hpp"

namespace haptic::sim {

/// Owner: the thread of the loop. `session` must outlive it.
class OtherMotion {
 public:
  /// @param drives  of the option --drive.
  /// @throws as HoldRun, read_drives and DriveRun.
  OtherMotion(CoreSession& session, std::vector<HoldCommand> holds,
              const std::vector<std::string>& drives);
  /// Keeps a tape; `whole`: with the driven parts after every tick, else after the last one.
  void tape(bool whole) { tape_.emplace(whole); }

  /// Where nothing else gives the hand its poses. `second`: the pose of a second hand; null: there
  /// is none.
  void before_tick(double t_s, const Pose* second = nullptr);
  /// Where something else does: the newest ones, by driven part.
  [[nodiscard]] std::span<const FrameRecord> poses_before_tick(double t_s);
  void after_tick(const tools::TickRecord& tick, const StepResult* second = nullptr);
  /// Takes them through the loop's memory, before a period of a stack.
  template <class Stack>
  void give(Stack& stack, double t_s) {
    const std::int64_t later_ns = stack.now_ns() - DriveRun::stamp_ns(t_s);
    const std::span<const FrameRecord> records = poses_before_tick(t_s);
    for (std::size_t k = 0; k < records.size(); ++k) {
      FrameRecord record = records[k];
      record.stamp_ns += later_ns;
      stack.drive(k, record);
    }
  }

  /// The newest tick as viewers get it.
  [[nodiscard]] tools::LiveState shown(const tools::TickRecord& tick) const;
  /// The driven parts after each tick; empty without a whole tape.
  [[nodiscard]] std::span<const tools::DrivenTick> driven() const;
  /// Energy that the hand's spring has had from driven parts up to each tick [J].
  [[nodiscard]] std::span<const double> given_j() const { return given_j_; }
  [[nodiscard]] const HoldRun& holds() const { return holds_; }
  [[nodiscard]] const DriveRun& drives() const { return drives_; }
  [[nodiscard]] bool keeps() const { return tape_.has_value(); }
  /// After tape().
  [[nodiscard]] const DriveTape& kept() const { return *tape_; }
  /// Failures of both; empty: none.
  [[nodiscard]] std::string failures() const;

 private:
  CoreSession& session_;
  HoldRun holds_;
  DriveRun drives_;
  std::optional<DriveTape> tape_;
  std::vector<double> given_j_;
};

}  // namespace haptic::sim
