// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The reference device as bytes: a simulated device and hand behind the protocol of
/// hal/drivers/PROTOCOL.md. It is a device, not an echo: it rejects wrong check sums and replayed
/// sequences, cuts its drives when commands stop, quantises, saturates and delays. One model serves
/// every carrier; there is no clock in it but the one that it is given.

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hal/drivers/reference_codec.hpp"
#include "host_sim/device/simulated_device.hpp"

namespace haptic::sim {

/// Where the hand wants to be, and its fingers, at a time of the device.
struct HandAction {
  HandTarget target;           ///< handle point and orientation in D
  std::uint32_t switches = 0;  ///< bits pressed
  double gap_m = 0;            ///< of the gripper, where the device has one
};

/// Encoder steps: the coarser of these and those of `device` (0: exact, except for the protocol's
/// own units); limits: the smaller. The device's W is D here.
struct ReferenceModelSettings {
  DeviceModel device;
  HandModel hand;
  double report_rate_hz = 1000;
  std::int64_t watchdog_ns = 20'000'000;  ///< without an accepted command, then drives off
  double encoder_step_m = 1.0e-6, encoder_step_rad = 1.0e-5;
  double max_force_n = 12, max_torque_nm = 0.3;
  /// Stated; the device's own limits grow at them when the drives go on. 0: not stated.
  double max_force_rate_n_per_s = 2000, max_torque_rate_nm_per_s = 40;
  bool twist_sensed = true;  ///< else velocities are sent as zero and not valid
  /// Version 1.1; a device of 1.0 answers every host as one of 1.0.
  bool speaks_1_1 = false;
  bool is_displacement = false;
  double latency_s = 0;      ///< stated, not simulated: that is `device`'s
  double largest_gap_m = 0;  ///< of the gripper; 0: it has none
  std::string name, serial;
};

/// Owner: one thread. Equal calls give equal bytes.
class ReferenceModel {
 public:
  /// Powered up, at the hand's first target. @throws tools::InputError  a setting out of range.
  ReferenceModel(const ReferenceModelSettings& settings,
                 std::function<HandAction(double t_s)> hand);

  /// Puts the device there, at rest; time goes on.
  void place(const DeviceState& state);
  /// Power on, or the firmware starts again without leaving the bus: counters 0, drives off,
  /// calibrated.
  void power_up();
  /// Bus reset, or the cable pulled out: as a command with the drives' bit clear, that acknowledges
  /// nothing.
  void drives_off();
  /// As `drives_off`, and who comes next has not asked for a block yet.
  void bus_event() {
    drives_off();
    host_speaks_1_1_ = false;
  }

  /// One report period passes: the wrench accepted so far acts, the hand moves. Then the report of
  /// the new sample is made, the watchdog first.
  void advance();
  /// Report of the last sample; before the first `advance` of sequence 0.
  [[nodiscard]] std::vector<std::uint8_t> report() const;
  /// The same into `bytes`, which has room for kReferenceReportBytes; @return the length. No heap.
  std::size_t report_into(std::span<std::uint8_t> bytes) const;

  /// Bytes from the host. Not a command of PROTOCOL.md, or a sequence that is not newer: counted in
  /// the reports, otherwise without effect. Returns whether it was accepted.
  bool command(std::span<const std::uint8_t> bytes);

  /// Answers the request for a block into `room` of the length that the host asks for, which says
  /// what version it speaks. @return the length; 0: a stall. No heap.
  std::size_t answer_into(std::span<std::uint8_t> room);
  /// The block of 1.0.
  [[nodiscard]] hal::ReferenceBlock block() const;
  /// This instead from now on, as another device would, or its own again; nothing else changes.
  void state_block(const std::optional<hal::ReferenceBlock>& block) { stated_ = block; }

  // The true state, for tests and reports.
  [[nodiscard]] const DeviceState& state() const { return device_.state(); }
  /// Wrench on the handle in the last period.
  [[nodiscard]] const Load& acting() const { return acting_; }
  /// Wrench of the last command accepted, as far as the drives give it since they went on; zero
  /// while they are off.
  [[nodiscard]] const Load& handed() const { return wrench_; }
  /// Work of the wrenches on the device so far [J].
  [[nodiscard]] double delivered_j() const { return device_.delivered_j(); }
  [[nodiscard]] double time_s() const;
  [[nodiscard]] double period_s() const { return 1.0 / settings_.report_rate_hz; }
  [[nodiscard]] bool drives_on() const { return on_; }
  /// Sequence of the last command accepted.
  [[nodiscard]] std::uint32_t accepted() const { return accepted_; }
  [[nodiscard]] std::uint32_t rejected() const { return rejected_; }
  /// How often the watchdog cut the drives.
  [[nodiscard]] std::uint32_t cuts() const { return cuts_; }
  /// How often the host took them off by a command: a session that ended in order, or a fault that
  /// the host answered.
  [[nodiscard]] std::uint32_t released() const { return released_; }

  // Faults of the device itself.
  /// Bits of DeviceFault's lower half, until set otherwise. kDeviceDriveFault and kDeviceNotHomed
  /// switch the drives off; the latter clears "calibrated".
  void set_faults(std::uint32_t device_faults);
  /// The input: pressed, the drives are off; released, until the host acknowledges.
  void press_emergency_stop(bool pressed);
  /// The encoders count from elsewhere from now on, until power-up.
  void jump_encoders(const Vector& by_m);

 private:
  [[nodiscard]] bool may_drive() const;
  void exert();
  [[nodiscard]] bool is_slewing() const;
  [[nodiscard]] std::int64_t time_ns() const;

  ReferenceModelSettings settings_;
  std::optional<hal::ReferenceBlock> stated_;
  std::function<HandAction(double)> hand_;
  SimulatedDevice device_;
  HandAction action_;
  std::uint64_t periods_ = 0;
  Vector jump_m_ = Vector::Zero();
  Load asked_, wrench_, acting_;  ///< accepted; of it, given now; on the handle in the last period
  std::uint64_t on_periods_ = 0;  ///< since the drives went on
  bool host_speaks_1_1_ = false;
  bool on_ = false, cut_ = false, stop_pressed_ = false, stopped_ = false;
  bool fresh_ = true;  ///< no command without the drives' bit since power-up
  std::int64_t fed_ns_ = 0;
  std::uint32_t sequence_ = 0, accepted_ = 0, tick_ = 0, rejected_ = 0, cuts_ = 0, released_ = 0,
                faults_ = 0;
};

}  // namespace haptic::sim
