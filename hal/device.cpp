// SPDX-License-Identifier: Apache-2.0
#include "hal/device.hpp"

#include <cstddef>

namespace haptic::hal {

const char* to_text(HalStatus status) noexcept {
  static constexpr const char* kTexts[] = {"ok", "device capabilities are not usable"};
  static_assert(sizeof(kTexts) / sizeof(kTexts[0]) == static_cast<std::size_t>(HalStatus::kCount));
  return status < HalStatus::kCount ? kTexts[static_cast<std::size_t>(status)] : "invalid status";
}

HalStatus check_capabilities(const DeviceCapabilities& c) noexcept {
  for (const Real x : {c.max_force_n, c.max_torque_nm, c.max_force_rate_n_per_s,
                       c.max_torque_rate_nm_per_s, c.max_stiffness_n_per_m, c.max_damping_ns_per_m,
                       c.mass_kg, c.damping_ns_per_m, c.coulomb_friction_n, c.encoder_step_m}) {
    if (!(x >= 0) || x - x != 0) return HalStatus::kBadCapabilities;
  }
  for (int k = 0; k < 3; ++k) {
    if (c.handle_offset_d[k] - c.handle_offset_d[k] != 0) return HalStatus::kBadCapabilities;
  }
  if (c.watchdog_ns < 0 || c.report_period_ns < 0) return HalStatus::kBadCapabilities;
  const bool known = ((c.sensed_dof | c.driven_dof) & ~std::uint32_t{kDofAll}) == 0;
  return known && (c.driven_dof & ~c.sensed_dof) == 0 ? HalStatus::kOk
                                                      : HalStatus::kBadCapabilities;
}

Wrench project_wrench(const Wrench& wrench_d, std::uint32_t driven_dof) noexcept {
  Wrench projected;
  for (int k = 0; k < 3; ++k) {
    if ((driven_dof >> k & 1u) != 0) projected.force_w[k] = wrench_d.force_w[k];
    if ((driven_dof >> (k + 3) & 1u) != 0) projected.torque_w[k] = wrench_d.torque_w[k];
  }
  return projected;
}

}  // namespace haptic::hal
