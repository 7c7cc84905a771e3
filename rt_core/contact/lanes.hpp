// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Four scalars at a time, written so that the instruction set cannot change a bit: only element by
/// element arithmetic, comparisons and selections, never a sum across lanes, and the lane count
/// does not depend on the target (a 128-bit target takes two instructions where a 256-bit one takes
/// one).

#include <cstdint>
#include <cstring>

#include "rt_core/base/scalar.hpp"

namespace haptic {

inline constexpr std::uint32_t kLanes = 4;

/// An integer as wide as Real: what a comparison of lanes gives (all ones or zero).
#if HAPTIC_REAL_IS_FLOAT
using LaneInt = std::int32_t;
#else
using LaneInt = std::int64_t;
#endif

using RealLanes = Real __attribute__((vector_size(kLanes * sizeof(Real))));
using LaneMask = LaneInt __attribute__((vector_size(kLanes * sizeof(Real))));

inline void load_lanes(const Real* from, RealLanes& to) noexcept {
  std::memcpy(&to, from, sizeof(to));
}
inline void store_lanes(const RealLanes& from, Real* to) noexcept {
  std::memcpy(to, &from, sizeof(from));
}

/// Whether any lane of a comparison holds.
inline bool any_lane(const LaneMask& mask) noexcept {
  return (mask[0] | mask[1] | mask[2] | mask[3]) != 0;
}

/// Points as three arrays of one padded length.
struct LanePoints {
  const Real* x = nullptr;
  const Real* y = nullptr;
  const Real* z = nullptr;
  std::uint32_t count = 0;  ///< padded, a multiple of kLanes

  [[nodiscard]] Vec3 at(std::uint32_t k) const noexcept { return {x[k], y[k], z[k]}; }
};

/// Index of the point with the largest n.p; the lowest index at ties. Cost: count / kLanes steps,
/// no branch inside.
[[nodiscard]] inline std::uint32_t highest_point(const LanePoints& points, const Vec3& n) noexcept {
  const Real nx = n[0], ny = n[1], nz = n[2];
  RealLanes x, y, z;
  load_lanes(points.x, x);
  load_lanes(points.y, y);
  load_lanes(points.z, z);
  RealLanes best = (x * nx + y * ny) + z * nz;
  LaneMask at{0, 1, 2, 3};
  LaneMask here = at;
  for (std::uint32_t k = kLanes; k < points.count; k += kLanes) {
    load_lanes(points.x + k, x);
    load_lanes(points.y + k, y);
    load_lanes(points.z + k, z);
    const RealLanes height = (x * nx + y * ny) + z * nz;
    here += static_cast<LaneInt>(kLanes);
    const LaneMask higher = height > best;
    best = higher ? height : best;
    at = higher ? here : at;
  }
  LaneInt index = at[0];
  Real top = best[0];
  for (std::uint32_t k = 1; k < kLanes; ++k) {
    const bool better = best[k] > top || (best[k] == top && at[k] < index);
    top = better ? best[k] : top;
    index = better ? at[k] : index;
  }
  return static_cast<std::uint32_t>(index);
}

}  // namespace haptic
