// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The coupling of a scene, once the size of its moving part is known: what the scene file gives,
/// and for the rest gains bounded by the device first, then by the length L, then by accuracy.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "rt_core/scene/scene_format.hpp"
#include "tools/common/file_place.hpp"

namespace haptic::tools {

/// The coupling as a scene file states it; absent gains are chosen.
struct CouplingRequest {
  std::optional<double> k_t_n_per_m, k_r_nm_per_rad, length_m, damping_ns_per_m;
  std::optional<double> damping_share, max_rotation_error_rad, max_translation_error_m;
  std::optional<double> min_window_s, max_window_s;
  std::optional<double> tolerance_m;
  std::optional<double> climb_m;  ///< 0: no step is climbed
  std::optional<std::uint32_t> passes;
  std::optional<bool> passivity;
  bool allow_active = false;
  FilePlace k_t_at, k_r_at, damping_at;  ///< k_r_at: of k_r or of the length
  FilePlace k_f_at;                      ///< of k_F, which [rendering] gives
};

struct CouplingChoice {
  CouplingParameters coupling{};
  std::vector<std::string> notes;  ///< a sentence for every gain that the device reduced
};

/// @param parameters  of the scene: its law, rate, k_F and device; its coupling is not looked at.
/// @param radius_m  of the moving part about its grip point.
/// @param never_turns  the part is held in one orientation: no word about a rotor.
/// @param file  of the scene, for messages.
/// @throws InputError with the place of a gain that the file gives and the device cannot hold,
/// unless it allows active gains.
CouplingChoice choose_coupling(const SceneParameters& parameters, const CouplingRequest& request,
                               double radius_m, bool never_turns = false,
                               const std::string& file = {});

}  // namespace haptic::tools
