// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Abilities of Force Dimension's devices by their type.

#include <string_view>

#include "rt_core/base/scalar.hpp"

namespace haptic::tools {

/// A device of libdhd. Force, torque, stiffness, damping and radius are those that CHAI3D
/// (CDeltaDevices.cpp) has for it.
struct DhdModel {
  std::string_view name;
  Real max_force_n = 0, max_torque_nm = 0;
  Real max_stiffness_n_per_m = 0, max_damping_ns_per_m = 0;
  Real workspace_radius_m = 0;
};

/// By dhdGetSystemType. Null: no source states anything of that type.
[[nodiscard]] const DhdModel* find_dhd_model(int type) noexcept;

/// For a type that no source describes: the least of the others, and no stiffness.
[[nodiscard]] const DhdModel& unknown_dhd_model() noexcept;

}  // namespace haptic::tools
