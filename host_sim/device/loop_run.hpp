// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A whole run of the closed loop along a hand motion, its CSV and its account.

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "host_sim/device/simulated_device.hpp"
#include "host_sim/session/core_session.hpp"
#include "host_sim/session/tick_csv.hpp"

namespace haptic::sim {

// The haptic loop closed on a desk: the core renders what the simulated device senses, and the
// device, with the hand on it, moves under what the core renders.

/// One tick: the sample, its result, and what acted until the next sample.
struct LoopTick {
  std::uint64_t tick = 0;
  double t_s = 0;
  DeviceState device;  ///< true state at the sample
  Pose sensed_wa;      ///< A's mesh frame as the core gets it
  Wrench accepted_w;   ///< that acted before, as the core gets it
  StepResult result;   ///< of the core
  Load acting;         ///< on the device from this sample to the next, after delay and amplifier
  double delivered_j = 0;  ///< work of the rendering on the device up to the next sample
};

/// Makes the session render a scene that names no device with gains that this one holds
/// (simulated_gains). `late_s`: from a sample to its command, beyond the device's own delay.
/// @return what has changed, a sentence; empty: nothing.
std::string fit_to_device(CoreSession& session, const DeviceModel& device, double rate_hz,
                          double late_s = 0);

/// Stamp of tick number `tick`, from one period on: a stamp of 0 means "not stamped".
[[nodiscard]] std::int64_t loop_stamp_ns(std::uint64_t tick, double rate_hz);

/// Not movable; `session` must outlive it. Owner: one thread.
class ClosedLoop {
 public:
  /// `rate_hz` from 1 to 1e6; `number` of the hand. @throws tools::InputError.
  ClosedLoop(CoreSession& session, const DeviceModel& device, const HandModel& hand, double rate_hz,
             std::uint32_t number = 0);
  ClosedLoop(const ClosedLoop&) = delete;
  ClosedLoop& operator=(const ClosedLoop&) = delete;

  /// A fresh start: core reset, tick 0 at time 0, device in `state`.
  void place(const DeviceState& state);

  /// One tick with the device held at rest in `state`: the core's history follows it there, as
  /// where a trial begins pressed in, which a proxy must have seen from outside.
  void guide(const DeviceState& state);

  /// Samples, steps the core, and lets the device move on for one period while the hand's target
  /// moves from `stroke.from` to `stroke.to`.
  LoopTick step(const HandStroke& stroke);

  /// The two halves of a step, where the core is stepped together with that of another hand.
  [[nodiscard]] StepInput sample() const;
  LoopTick move_on(const StepInput& sample, const StepResult& result, const HandStroke& stroke);

  [[nodiscard]] double period_s() const { return period_s_; }
  /// Time of the next tick.
  [[nodiscard]] double time_s() const { return static_cast<double>(tick_) / rate_hz_; }
  [[nodiscard]] const SimulatedDevice& device() const { return device_; }

  [[nodiscard]] LawId law() const { return session_.view().parameters().law; }
  /// Grip point in A's mesh frame [m].
  [[nodiscard]] Vec3 grip_in_part() const { return grip_a_.cast<Real>(); }
  /// The grip point and orientation of a pose of A's mesh frame, and back.
  [[nodiscard]] HandTarget grip_of(const Vector& p_wa, const Rotation& q_wa) const;
  [[nodiscard]] HandTarget grip_of(const MotionSample& sample) const;
  [[nodiscard]] Pose mesh_pose(const HandTarget& grip) const;

 private:
  CoreSession& session_;
  double rate_hz_, period_s_;
  Vector grip_a_;  ///< grip point in A's mesh frame
  SimulatedDevice device_;
  Load accepted_;  ///< acted in the period before
  std::uint64_t tick_ = 0;
};

/// The values of every tick that a run keeps.
struct LoopRecord {
  TickRecord tick;
  Wrench accepted_w;                    ///< that acted before the tick, as the core got it
  std::array<double, 3> target_m{};     ///< of the hand, for A's mesh frame
  std::array<double, 4> target_wxyz{};  ///< and its orientation
  double speed_m_per_s = 0, turn_rad_per_s = 0;
  double delivered_j = 0;  ///< work of the rendering on the device so far
};

/// Record of a tick, without the hand's target.
[[nodiscard]] LoopRecord loop_record(const ClosedLoop& loop, const LoopTick& tick);

/// Runs the hand's targets through the loop, one sample per tick, the device at rest at the first.
/// `motion` has the loop's rate. `before_tick` is called before each with its time, `after_tick`
/// after each. Cost: the ticks.
[[nodiscard]] std::vector<LoopRecord> run_loop(
    ClosedLoop& loop, std::span<const MotionSample> motion,
    const std::function<void(const LoopRecord&)>& after_tick = {},
    const std::function<void(double t_s)>& before_tick = {});

/// Both hands of a scene, each with a loop and a motion; the shorter one rests at its end. As
/// run_loop. `after_tick` is called once both have moved on, with what their cores said.
[[nodiscard]] Hands::Each<std::vector<LoopRecord>> run_loops(
    CoreSession& session, const Hands::Each<ClosedLoop*>& loops,
    const Hands::Each<std::span<const MotionSample>>& motions,
    const std::function<void(const Hands::Each<LoopRecord>&, const Hands::Each<StepResult>&)>&
        after_tick = {},
    const std::function<void(double t_s)>& before_tick = {});

/// Header of the run's CSV, without the end of line: the replay's columns, then proxy, device, hand
/// and energy.
[[nodiscard]] std::string loop_csv_header();
/// Appends one line of the CSV, without its end.
void append_loop_row(std::string& csv, const LoopRecord& record);
/// The end of each line: the columns of the guide where there is one, and those that came later.
[[nodiscard]] std::string last_columns(const GuideLegs& legs);
void append_last_cells(std::string& csv, const TickRecord& tick, const GuideLegs& legs);
/// CSV of a run; LF.
[[nodiscard]] std::string loop_csv(std::span<const LoopRecord> records, const GuideLegs& legs = {});

/// Speeds that no hand moves a device at.
inline constexpr double kRunawaySpeed_m_per_s = 10, kRunawayTurn_rad_per_s = 200;

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
  double largest_speed_m_per_s = 0, largest_turn_rad_per_s = 0;
  bool finite = true;  ///< no NaN or infinity came out
  /// The device was faster than any hand moves one: the loop has blown up.
  [[nodiscard]] bool runs_away() const {
    return largest_speed_m_per_s > kRunawaySpeed_m_per_s ||
           largest_turn_rad_per_s > kRunawayTurn_rad_per_s;
  }
};
[[nodiscard]] LoopTotals total(std::span<const LoopRecord> records);

}  // namespace haptic::sim
