// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Where a cell of the fault matrix is played: a stack with the simulated hand on its device, in
/// one thread and virtual time (StackStage) or in its threads and real time
/// (host_sim/lab/realtime/threaded_stage.hpp).

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "host_sim/device/device_stack.hpp"
#include "host_sim/device/reference_usb.hpp"
#include "host_sim/lab/faults/fault_table.hpp"

namespace haptic::sim {

// What is kept of a cell of the fault matrix while it is played: one sample per period of the
// device.

/// One period.
struct FaultSample {
  std::vector<StackSend> sent;
  Load acting;
  std::uint32_t acts = 0;      ///< sequence of the command that the device had when this began
  std::uint32_t accepted = 0;  ///< sequence of the command that the device has accepted last
  bool drives_on = false;
  std::uint32_t watchdog_cuts = 0;
  ArmingState arming = ArmingState::kDisarmed;
  std::uint32_t safety = 0;  ///< SafetyFault, latched
  std::uint32_t device = 0;  ///< DeviceFault, as the servo tick got
  LinkState link = LinkState::kAbsent;
  /// How late the machine let the slowest of device, USB thread and servo thread be in this period
  /// [ns]; in virtual time 0. Delays that the fault itself brings about do not count.
  std::int64_t late_ns = 0;
};

/// A run; sample k is the k-th period of the device. Indices are of the first sample after the
/// action that they name.
struct FaultTrace {
  double period_s = 0;
  std::vector<FaultSample> samples;  ///< of the device that the fault is at
  std::vector<FaultSample> others;   ///< of that of another hand; else empty
  std::size_t injected = 0;          ///< the fault
  std::size_t cleared =
      0;  ///< its cause removed, the device reconnected, the deadman switch released
  std::size_t pressed = 0;  ///< the deadman, on the wall
};

/// The hand goes from one target to the next by minimum jerk and holds switches; D axes.
struct HandPlan {
  HandTarget from, to;
  double begin_s = 0, end_s = 0;  ///< of the device's time
  std::uint32_t switches = 0;

  [[nodiscard]] HandTarget at(double t_s) const {
    if (t_s >= end_s) return to;
    const double u = std::max(0.0, (t_s - begin_s) / (end_s - begin_s));
    const double way = u * u * u * (10 + u * (6 * u - 15));
    return {from.x0_w + way * (to.x0_w - from.x0_w), from.q_wa.slerp(way, to.q_wa)};
  }
  [[nodiscard]] HandAction action(double t_s) const { return {at(t_s), switches}; }
};

/// Owner: one thread, on which the device's periods pass. Everything that fails does so between two
/// periods.
class FaultStage {
 public:
  virtual ~FaultStage() = default;

  /// One period of the device, and what was seen of it.
  FaultSample step() {
    FaultSample sample = pass_period();
    ++periods_;
    if (watch_) watch_(sample);
    return sample;
  }
  /// Called after each period; empty: nobody.
  void watch(std::function<void(const FaultSample&)> watch) { watch_ = std::move(watch); }
  [[nodiscard]] double period_s() const { return period_s_; }
  [[nodiscard]] double time_s() const { return static_cast<double>(periods_) * period_s_; }
  [[nodiscard]] HandPlan& hand() { return hand_; }
  /// The last period of another hand, which does what this one does until `leave_other`; null:
  /// there is none.
  [[nodiscard]] virtual const FaultSample* other() const { return nullptr; }
  /// The other hand goes on with what it is at.
  virtual void leave_other() {}

  [[nodiscard]] virtual ReferenceUsb& bus() = 0;
  virtual void emergency_stop() = 0;
  /// The call of the link.
  virtual void stop_link() = 0;
  /// The machine sleeps and wakes.
  virtual void suspend() = 0;
  /// No tick for so many periods from now on.
  virtual void stall_servo(unsigned periods) = 0;
  /// The servo thread says what the cause makes of its commands, until `release_servo`.
  virtual void spoil_commands(FaultCause cause) = 0;
  /// Its process ends, and the link is informed.
  virtual void lose_servo() = 0;
  /// Nothing is wrong with the servo thread any more; not after lose_servo.
  virtual void release_servo() = 0;
  /// Another process, without history.
  virtual void restart_servo() = 0;
  /// Unplugged for good, or plugged in again (with `power`: the device was without power too).
  virtual void unplug() = 0;
  virtual void plug(bool power) = 0;

 protected:
  /// `hand`: at the start.
  FaultStage(double period_s, const HandPlan& hand) : period_s_(period_s), hand_(hand) {}
  virtual FaultSample pass_period() = 0;

 private:
  double period_s_;
  std::uint64_t periods_ = 0;
  HandPlan hand_;
  std::function<void(const FaultSample&)> watch_;
};

}  // namespace haptic::sim
