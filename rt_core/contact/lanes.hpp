// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Several scalars at a time, written so that the instruction set cannot change a bit: only element
/// by element arithmetic, comparisons and selections whose result does not depend on the order in
/// which elements meet (a largest value, the lowest index at ties), never a sum across lanes. The
/// vector is as wide as the target's registers; memory is laid out for the widest.

#include <cstdint>
#include <cstring>

#include "rt_core/base/scalar.hpp"
#include "rt_core/scene/scene_format.hpp"

namespace haptic {

#if defined(__AVX__)
inline constexpr std::uint32_t kVectorBytes = 32;
#else
inline constexpr std::uint32_t kVectorBytes = 16;
#endif
inline constexpr std::uint32_t kLanes = kVectorBytes / sizeof(Real);
static_assert(kLanePadding % kLanes == 0);

/// An integer as wide as Real: what a comparison of lanes gives (all ones or zero).
#if HAPTIC_REAL_IS_FLOAT
using LaneInt = std::int32_t;
#else
using LaneInt = std::int64_t;
#endif

using RealLanes = Real __attribute__((vector_size(kVectorBytes)));
using LaneMask = LaneInt __attribute__((vector_size(kVectorBytes)));

inline void load_lanes(const Real* from, RealLanes& to) noexcept {
  std::memcpy(&to, from, sizeof(to));
}
inline void store_lanes(const RealLanes& from, Real* to) noexcept {
  std::memcpy(to, &from, sizeof(from));
}

/// True if any lane of a comparison holds.
inline bool any_lane(const LaneMask& mask) noexcept {
  LaneInt any = 0;
  for (std::uint32_t k = 0; k < kLanes; ++k) any |= mask[k];
  return any != 0;
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
  // Indices as numbers of the scalar, which hold them exactly, so that one kind of selection
  // serves.
  RealLanes here{};
  for (std::uint32_t k = 0; k < kLanes; ++k) here[k] = static_cast<Real>(k);
  RealLanes at = here;
  for (std::uint32_t k = kLanes; k < points.count; k += kLanes) {
    load_lanes(points.x + k, x);
    load_lanes(points.y + k, y);
    load_lanes(points.z + k, z);
    const RealLanes height = (x * nx + y * ny) + z * nz;
    here += static_cast<Real>(kLanes);
    const LaneMask higher = height > best;
    best = higher ? height : best;
    at = higher ? here : at;
  }
  Real index = at[0];
  Real top = best[0];
  for (std::uint32_t k = 1; k < kLanes; ++k) {
    const bool better = best[k] > top || (best[k] == top && at[k] < index);
    top = better ? best[k] : top;
    index = better ? at[k] : index;
  }
  return static_cast<std::uint32_t>(index);
}

}  // namespace haptic
