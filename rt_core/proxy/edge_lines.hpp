// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The lines between the nearest points of two edges: two facets neither of which has a vertex over
/// the other are apart along one of them, and along none of their C-faces.

#include <cstdint>

#include "rt_core/base/pose.hpp"
#include "rt_core/scene/scene_view.hpp"

namespace haptic {

/// From the nearest point of edge `j` of B to that of edge `i` of A, W axes [m]; arguments as those
/// of plane_gap. (V. Lumelsky, On fast computation of distance between line segments, Inf. Proc.
/// Letters 21, 1985, with the parameters clamped one after the other.)
[[nodiscard]] Vec3 line_between_edges_m(const PairView& pair, const Mat3& r_wa, const Vec3& y_w,
                                        std::uint32_t i, std::uint32_t j) noexcept;

}  // namespace haptic
