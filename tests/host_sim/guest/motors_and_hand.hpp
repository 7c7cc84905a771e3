// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The mechanics of a device without its firmware: ReferenceModel's handle with a hand on it, moved
/// by what its motors are told, and sampled as encoders would be. The model's own protocol is fed
/// by us alone.

#include <array>
#include <cstdint>

#include "hal/drivers/reference_codec.hpp"
#include "hal/firmware/reference_device.h"
#include "host_sim/device/reference_model.hpp"

namespace haptic::sim::test {

/// Owner: one thread.
class MotorsAndHand {
 public:
  MotorsAndHand(const ReferenceModelSettings& settings, std::function<HandAction(double t_s)> hand)
      : model_(settings, std::move(hand)) {}

  /// One period: the motors' task acts through it. @return the sample after it.
  haptic_sample pass(const haptic_drive& drive) {
    hal::ReferenceCommand c;
    c.drives_on = drive.is_on != 0;
    c.sequence = ++sequence_;
    for (std::size_t k = 0; k < 3; ++k) {
      c.force[k] = drive.force[k];
      c.torque[k] = drive.torque[k];
    }
    std::array<std::uint8_t, hal::kReferenceCommandBytes> bytes{};
    hal::encode(c, bytes);
    (void)model_.command(bytes);
    model_.advance();
    hal::ReferenceReport r;
    (void)hal::decode(model_.report(), r);
    haptic_sample sample{};
    sample.time_us = r.time_us;
    for (std::size_t k = 0; k < 3; ++k) {
      sample.position_nm[k] = r.position[k];
      sample.velocity_um_per_s[k] = r.velocity[k];
      sample.angular_velocity_urad_per_s[k] = r.angular_velocity[k];
    }
    for (std::size_t k = 0; k < 4; ++k) sample.orientation[k] = r.orientation[k];
    sample.switches = r.switches;
    sample.is_calibrated = 1;
    return sample;
  }

  /// Statement of the device about itself, of full speed or of high speed.
  [[nodiscard]] haptic_facts facts(bool is_short) const {
    const hal::ReferenceBlock b = model_.block();
    haptic_facts f{};
    f.twist_sensed = b.twist_sensed ? 1 : 0;
    f.is_short = is_short ? 1 : 0;
    f.sensed_dof = b.sensed_dof;
    f.driven_dof = b.driven_dof;
    f.report_period_us = b.report_period_us;
    f.watchdog_ms = b.watchdog_ms;
    f.max_force = b.max_force;
    f.max_torque = b.max_torque;
    f.max_force_rate_mn_per_s = b.max_force_rate_mn_per_s;
    f.max_torque_rate_mnm_per_s = b.max_torque_rate_mnm_per_s;
    f.mass_mg = b.mass_mg;
    f.damping_uns_per_m = b.damping_uns_per_m;
    f.encoder_step_nm = b.encoder_step_nm;
    f.encoder_step_nrad = b.encoder_step_nrad;
    return f;
  }
  [[nodiscard]] const ReferenceModel& model() const { return model_; }

 private:
  ReferenceModel model_;
  std::uint32_t sequence_ = 0;
};

}  // namespace haptic::sim::test
