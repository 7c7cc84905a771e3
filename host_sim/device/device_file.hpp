// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A device model from a TOML file: a `[device]` table with the keys of a scene's (README of the
/// graph compiler) and, for rotation, rotor_kg_m2, rotor_damping_nms_per_rad, coulomb_torque_nm,
/// encoder_step_rad, and delay_samples instead of delay_s. Keys left out keep the values of
/// DeviceModel.

#include <string>

#include "host_sim/device/simulated_device.hpp"

namespace haptic::sim {

/// `rate_hz`: of the loop, for delay_s. Limits of rate, stiffness and damping are read and not
/// used: the core and the compiler act on them, the device does not.
/// @throws tools::InputError with file and line: unreadable file, TOML syntax, unknown key, value
///         out of range.
[[nodiscard]] DeviceModel read_device_file(const std::string& path, double rate_hz);

}  // namespace haptic::sim
