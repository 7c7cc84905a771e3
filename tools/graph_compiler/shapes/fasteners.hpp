// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Sizes and fits of ISO metric fasteners.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace haptic::tools {

/// Coarse pitch of ISO 261, hexagon of ISO 4014 and ISO 4032 (nominal head, largest nut) [m].
struct FastenerSize {
  std::string_view name;
  double diameter_m, pitch_m, width_across_flats_m, head_height_m, nut_height_m;
};

/// M3 to M20.
const std::vector<FastenerSize>& fastener_sizes();
const FastenerSize* fastener_size(std::string_view name);

/// Radial allowance [m] of a tolerance class of ISO 965-1 at this pitch: half of its fundamental
/// deviation, which for g and G is (15 + 11 P) um with P in mm, for f (30 + 11 P), for e (50 + 11
/// P), and 0 for h and H. The grade ("6") is not used: the part has its largest material.
/// @param fit  "6g", "6H", or both as "6H/6g" in either order: then the one of the thread's kind.
/// @returns nothing when `fit` is no such class, or has none for this kind of thread.
std::optional<double> fit_clearance_m(std::string_view fit, bool internal, double pitch_m);

}  // namespace haptic::tools
