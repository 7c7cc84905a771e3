// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/program/coupling_table.hpp"

#include <string>

#include "rt_core/scene/capacity.hpp"
#include "tools/common/toml_table.hpp"
#include "tools/graph_compiler/graph/coupling_defaults.hpp"

namespace haptic::tools {
namespace {

constexpr Range kStiffness{0.0, kMaxStiffness_n_per_m, true};
constexpr Range kRotaryStiffness{0.0, kMaxStiffness_n_per_m* kMaxSceneLength_m* kMaxSceneLength_m,
                                 true};
constexpr Range kLength{0.0, kMaxSceneLength_m, true};
constexpr Range kDamping{0.0, kMaxCouplingDamping_ns_per_m};
constexpr Range kShare{0.0, 1.0};
constexpr Range kRotation{0.0, kMaxRotationError_rad, true};
constexpr Range kWindow{0.0, kMaxWindow_s};

}  // namespace

CouplingRequest read_coupling(const TomlTable& top, const DeviceParameters& device) {
  CouplingRequest request;
  const auto t = top.table(
      "coupling", {"k_t_n_per_m", "k_r_nm_per_rad", "length_m", "damping_ns_per_m", "damping_share",
                   "max_rotation_error_rad", "max_translation_error_m", "min_window_s",
                   "max_window_s", "passivity", "allow_active", "passes", "tolerance_m"});
  if (!t) return request;
  request.k_t_n_per_m = t->number("k_t_n_per_m", kStiffness);
  request.k_r_nm_per_rad = t->number("k_r_nm_per_rad", kRotaryStiffness);
  request.length_m = t->number("length_m", kLength);
  if (request.k_r_nm_per_rad && request.length_m) {
    t->fail("length_m", "k_r_nm_per_rad is given too, which is k_t times its square; keep one");
  }
  request.damping_ns_per_m = t->number("damping_ns_per_m", kDamping);
  request.damping_share = t->number("damping_share", kShare);
  request.max_rotation_error_rad = t->number("max_rotation_error_rad", kRotation);
  request.max_translation_error_m = t->number("max_translation_error_m", kLength);
  request.min_window_s = t->number("min_window_s", kWindow);
  request.max_window_s = t->number("max_window_s", {0.0, kMaxWindow_s, true});
  const double least = request.min_window_s.value_or(kDefaultMinWindow_s);
  if (request.max_window_s && *request.max_window_s < least) {
    t->fail("max_window_s", "is below min_window_s (default 0.001); give at least that");
  }
  request.passivity = t->flag("passivity");
  if (request.passivity.value_or(false) && !(device.mass_kg > 0.0)) {
    t->fail("passivity", "its damping is limited by the mass of the device; give [device] mass_kg");
  }
  if (const auto passes = t->integer("passes")) {
    if (*passes < 1 || *passes > kMaxProxyPasses) {
      t->fail("passes", "is " + std::to_string(*passes) + "; give a whole number from 1 to " +
                            std::to_string(kMaxProxyPasses));
    }
    request.passes = static_cast<std::uint32_t>(*passes);
  }
  request.tolerance_m = t->number("tolerance_m", kLength);
  request.allow_active = t->flag("allow_active").value_or(false);
  request.k_t_at = t->place("k_t_n_per_m");
  request.k_r_at = t->place(request.length_m ? "length_m" : "k_r_nm_per_rad");
  request.damping_at = t->place("damping_ns_per_m");
  return request;
}

}  // namespace haptic::tools
