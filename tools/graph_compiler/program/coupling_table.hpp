// SPDX-License-Identifier: Apache-2.0
#pragma once
/// `[coupling]` of a scene file: what the scene says about the spring between proxy and device, and
/// where it says so. Open values are chosen once the size of the part is known
/// (coupling_choice.hpp).

#include <optional>

#include "rt_core/scene/scene_format.hpp"
#include "tools/common/file_place.hpp"

namespace haptic::tools {

class TomlTable;

/// Values as in the file; absent ones are derived.
struct CouplingRequest {
  std::optional<double> k_t_n_per_m, k_r_nm_per_rad, length_m, damping_ns_per_m;
  std::optional<double> damping_share, max_rotation_error_rad, max_translation_error_m;
  std::optional<double> min_window_s, max_window_s;
  std::optional<double> tolerance_m;
  std::optional<std::uint32_t> passes;
  std::optional<bool> passivity;
  bool allow_active = false;
  FilePlace k_t_at, k_r_at, damping_at;  ///< k_r_at: of k_r or of the length
  FilePlace k_f_at;                      ///< of k_F, which [rendering] gives
};

/// Reads `[coupling]`, which may be absent; `device` is that of the scene.
/// @throws InputError with the place.
CouplingRequest read_coupling(const TomlTable& top, const DeviceParameters& device);

}  // namespace haptic::tools
