// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Small predicates shared by the checks of SceneView::open.

#include <cstdint>
#include <limits>

#include "rt_core/scene/scene_format.hpp"

namespace haptic::check {

/// Neither NaN nor infinite.
template <typename T>
[[nodiscard]] constexpr bool finite(T x) noexcept {
  return x - x == T{0};
}

[[nodiscard]] constexpr bool positive(double x) noexcept { return finite(x) && x > 0.0; }

/// [offset, offset + count) lies in [0, size).
[[nodiscard]] constexpr bool within(std::uint64_t offset, std::uint64_t count,
                                    std::uint64_t size) noexcept {
  return offset <= size && count <= size - offset;
}

[[nodiscard]] constexpr double absolute(double x) noexcept { return x < 0.0 ? -x : x; }

/// A coordinate [m] that the format allows; false for NaN.
[[nodiscard]] constexpr bool is_coordinate(double x) noexcept {
  return absolute(x) <= kMaxSceneLength_m;
}

/// Rounding of stored geometry, as a share of the largest coordinate: vertices are nearest Reals
/// and lie on planes of nearest Reals, so a few ulp; 256 leaves room for data that was rounded once
/// before.
inline constexpr double kGeometryTolerance = 256.0 * static_cast<double>(kRealEpsilon);

}  // namespace haptic::check
