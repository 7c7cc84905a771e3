// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The reference device as bytes: a simulated device and hand behind the protocol of
/// hal/drivers/PROTOCOL.md. It is a device, not an echo: it rejects wrong check sums and replayed
/// sequences, cuts its drives when commands stop, quantises, saturates and delays. One model serves
/// every carrier; there is no clock in it but the one that it is told.

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "hal/drivers/reference_codec.hpp"
#include "host_sim/device/simulated_device.hpp"

namespace haptic::sim {

/// Where the hand wants to be, and its fingers, at a time of the device.
struct HandAction {
  HandTarget target;           ///< handle point and orientation in D
  std::uint32_t switches = 0;  ///< bits pressed
};

struct ReferenceModelSettings {
  DeviceModel device;
  HandModel hand;
  double report_rate_hz = 1000;
  std::int64_t watchdog_ns =
      20'000'000;  ///< drives are cut when no valid command came for this long
  double encoder_step_m = 1.0e-6, encoder_step_rad = 1.0e-5;  ///< finer: the protocol's units
  double max_force_n = 12, max_torque_nm = 0.3;
};

class ReferenceModel {
 public:
  ReferenceModel(const ReferenceModelSettings& settings,
                 std::function<HandAction(double t_s)> hand);

  /// Puts the device there, at rest; time goes on.
  void place(const DeviceState& state);
  /// Power on: sequence from 0, drives off, calibrated.
  void power_up();

  /// One report period passes: the wrench accepted so far acts, the hand moves. Then the report of
  /// the new sample.
  void advance();
  [[nodiscard]] std::vector<std::uint8_t> report() const;

  /// Bytes from the host. Wrong length, check sum, version or a sequence that is not newer:
  /// counted, reported in the next reports, otherwise without effect.
  void command(std::span<const std::uint8_t> bytes);

  // What really happens, for tests and reports.
  [[nodiscard]] const DeviceState& state() const;
  [[nodiscard]] const Load& acting() const;  ///< wrench on the handle in the last period
  [[nodiscard]] double time_s() const;
  [[nodiscard]] bool drives_on() const;
  [[nodiscard]] std::uint32_t rejected() const;
  [[nodiscard]] std::uint32_t cuts() const;  ///< how often the watchdog cut the drives
  // Faults of the device itself.
  void set_faults(std::uint32_t device_faults);
  void jump_encoders(const Vector& by_m);

 private:
  ReferenceModelSettings settings_;
  std::function<HandAction(double)> hand_;
  SimulatedDevice device_;
};

}  // namespace haptic::sim
