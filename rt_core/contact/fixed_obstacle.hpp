// SPDX-License-Identifier: Apache-2.0
#pragma once
/// One C-obstacle of a part that never turns: a list of planes with constant normals (scene/
/// fixed_planes.hpp). A position is outside exactly if it lies before one of them, so one pass over
/// the list gives D_near, the verdict and its certificate at once, without history.

#include <cstdint>
#include <limits>
#include <span>

#include "rt_core/contact/c_face_plane.hpp"
#include "rt_core/contact/near_set.hpp"
#include "rt_core/contact/pair_verdict.hpp"
#include "rt_core/contact/valid_planes.hpp"
#include "rt_core/scene/scene_view.hpp"

namespace haptic {

/// Gap along a plane at y [m].
[[nodiscard]] inline Real gap_at(const FixedPlane& plane, const Vec3& y_w) noexcept {
  return ConstVec3Map(plane.normal).dot(y_w) - plane.offset_m;
}

/// A plane of the list as the proxy names one: its number stands in the features.
[[nodiscard]] inline PlaneId fixed_plane_id(std::uint32_t number) noexcept {
  return {ContactType::kB, static_cast<std::uint16_t>(number & 0xFFFFu),
          static_cast<std::uint16_t>(number >> 16), false};
}
[[nodiscard]] inline std::uint32_t plane_number(const PlaneId& id) noexcept {
  return id.i | std::uint32_t{id.j} << 16;
}

/// As find_near_set, at y. SupportPair::a of the result is the number of the nearest plane. Cost:
/// every plane once, and the nodes of those within a few epsilon of D_near.
[[nodiscard]] NearResult find_fixed_near_set(const PairView& pair, const Vec3& y_w, Real size_m,
                                             Real epsilon_m, BoundedList<NearNode>& near,
                                             NodeScope scope) noexcept;

/// Nearest plane of the list and the gap along it: D_near. The lowest number at ties. Cost: every
/// bounding plane once.
struct NearestPlane {
  std::uint32_t number = 0;
  Real gap_m = -std::numeric_limits<Real>::max();
};
[[nodiscard]] NearestPlane nearest_fixed_plane(const PairView& pair, const Vec3& y_w) noexcept;

/// The sign of D_near: the nearest plane separates, or no plane of the list does and x is inside.
[[nodiscard]] VerdictResult fixed_verdict(const NearResult& near, Real rounding_m) noexcept;

/// As plane_gap, of a plane of the list.
[[nodiscard]] PlaneGap fixed_plane_gap(const PairView& pair, const Vec3& y_w,
                                       const PlaneId& id) noexcept;

/// As find_valid_planes: every plane of the list with a gap of at least `least_gap_m`, faces first.
[[nodiscard]] ValidResult find_valid_fixed_planes(const PairView& pair, const Vec3& y_w,
                                                  Real least_gap_m,
                                                  std::span<ValidPlane> planes) noexcept;

}  // namespace haptic
