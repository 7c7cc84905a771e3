// SPDX-License-Identifier: Apache-2.0
#include "hal/device.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace haptic::hal {

const char* to_text(HalStatus status) noexcept {
  static constexpr const char* kTexts[] = {
      "ok",
      "device capabilities are not usable",
      "USB is not available on this machine",
      "no such device is connected",
      "this user may not open the device",
      "another program or driver holds the device",
      "device was unplugged",
      "device lacks the interface or endpoints of its driver",
      "USB transfer failed",
      "device did not answer in time",
      "device could not be started: firmware, homing or calibration failed",
      "firmware file cannot be read or is not a firmware image",
      "out of memory",
      "operating system refused a call",
      "the device does not fit what it is to be used for",
      "firmware file is not a known one; nothing was sent",
  };
  static_assert(sizeof(kTexts) / sizeof(kTexts[0]) == static_cast<std::size_t>(HalStatus::kCount));
  return status < HalStatus::kCount ? kTexts[static_cast<std::size_t>(status)] : "invalid status";
}

namespace {

bool is_limit(Real x) noexcept { return std::isfinite(x) && x >= 0; }
bool is_limit(const Vec3& v) noexcept {
  return is_limit(v.x()) && is_limit(v.y()) && is_limit(v.z());
}

bool is_printable(char letter) noexcept { return letter >= 0x20 && letter <= 0x7e; }

}  // namespace

DeviceText device_text(std::string_view text) noexcept {
  DeviceText made{};
  const std::size_t size = std::min(text.find('\0'), std::min(text.size(), made.size() - 1));
  std::ranges::transform(text.substr(0, size), made.begin(),
                         [](char letter) { return is_printable(letter) ? letter : '?'; });
  return made;
}

std::string_view text_of(const DeviceText& text) noexcept {
  return {text.data(), static_cast<std::size_t>(std::ranges::find(text, '\0') - text.begin())};
}

bool is_text(const DeviceText& text) noexcept {
  const auto end = std::ranges::find(text, '\0');
  return end != text.end() && std::all_of(text.begin(), end, is_printable) &&
         std::all_of(end, text.end(), [](char letter) { return letter == '\0'; });
}

HalStatus check_capabilities(const DeviceCapabilities& c) noexcept {
  for (const Real x : {c.max_force_n, c.max_torque_nm, c.max_force_rate_n_per_s,
                       c.max_torque_rate_nm_per_s, c.max_stiffness_n_per_m, c.max_damping_ns_per_m,
                       c.mass_kg, c.damping_ns_per_m, c.coulomb_friction_n, c.encoder_step_m,
                       c.encoder_step_rad, c.workspace_radius_m, c.largest_gap_m}) {
    if (!is_limit(x)) return HalStatus::kBadCapabilities;
  }
  if (!is_limit(c.max_axis_force_n) || !is_limit(c.max_axis_torque_nm)) {
    return HalStatus::kBadCapabilities;
  }
  constexpr Real kUnitSlack = 1.0e-4_r;  // of the square; a float's rounding is far below
  const Real square = c.q_wd.squaredNorm();
  if (!(square > 1 - kUnitSlack && square < 1 + kUnitSlack) || !is_finite(c.handle_offset_h)) {
    return HalStatus::kBadCapabilities;
  }
  if (!is_text(c.name) || !is_text(c.serial)) return HalStatus::kBadCapabilities;
  if (c.watchdog_ns < 0 || c.latency_ns < 0 || c.report_period_ns < 0 || c.bus_interval_ns < 0)
    return HalStatus::kBadCapabilities;
  const bool known = ((c.sensed_dof | c.driven_dof) & ~std::uint32_t{kDofAll}) == 0;
  return known && (c.driven_dof & ~c.sensed_dof) == 0 ? HalStatus::kOk
                                                      : HalStatus::kBadCapabilities;
}

std::int64_t report_interval_ns(const DeviceCapabilities& capabilities) noexcept {
  return std::max(capabilities.report_period_ns, capabilities.bus_interval_ns);
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
