// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A whole run of the closed loop along a hand motion, its CSV and its account.

#include <array>
#include <span>
#include <string>
#include <vector>

#include "host_sim/device/closed_loop.hpp"
#include "host_sim/session/tick_record.hpp"

namespace haptic::sim {

/// What a run keeps of every tick.
struct LoopRecord {
  TickRecord tick;
  Pose device_wa, proxy_wa;          ///< A's mesh frame: as sensed, and as shown
  std::array<double, 3> target_m{};  ///< of the hand, for A's mesh frame
  double speed_m_per_s = 0, turn_rad_per_s = 0;
  double delivered_j = 0;  ///< work of the rendering on the device so far
};

/// Runs the hand's targets through the loop, one sample per tick, the device at rest at the first.
/// `motion` has the loop's rate. Cost: the ticks.
[[nodiscard]] std::vector<LoopRecord> run_loop(ClosedLoop& loop,
                                               std::span<const MotionSample> motion);

/// Header of the run's CSV, without the end of line: the replay's columns, then proxy, device, hand
/// and energy.
[[nodiscard]] std::string loop_csv_header();
/// Appends one line of the CSV, without its end.
void append_loop_row(std::string& csv, const LoopRecord& record);
/// CSV of a run; LF.
[[nodiscard]] std::string loop_csv(std::span<const LoopRecord> records);

struct LoopTotals {
  std::uint64_t ticks = 0, contact_ticks = 0, refused_poses = 0;
  double duration_s = 0;
  double largest_force_n = 0, largest_torque_nm = 0;
  double largest_force_step_n = 0, largest_torque_step_nm = 0;
  double force_step_at_s = 0, torque_step_at_s = 0;        ///< end of the largest step
  double largest_delivered_j = 0;                          ///< most that was ever given out
  double delivered_j = 0;                                  ///< at the end
  double least_energy_j = 0;                               ///< of the core's observer
  double rest_speed_m_per_s = 0, rest_turn_rad_per_s = 0;  ///< largest in the last tenth
  double smallest_gap_m = 0;                               ///< of the proxy
  bool finite = true;                                      ///< no NaN or infinity came out
};
[[nodiscard]] LoopTotals total(std::span<const LoopRecord> records);

}  // namespace haptic::sim
