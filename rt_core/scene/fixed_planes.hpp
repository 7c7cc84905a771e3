// SPDX-License-Identifier: Apache-2.0
#pragma once
/// C-obstacles of a scene whose part never turns: it has one orientation, so every C-face keeps its
/// normal, and each C-obstacle is a list of half spaces of the positions y = x_0^A minus the
/// reference of B's body. Quantities that depend on the orientation are constant and stored:
/// offsets, violations, rises. Sections kFixedPairs, kFixedPlanes and kFixedNodes; vertices of A in
/// kVertexLanes are turned already. Such a scene has no arcs, relaxations, stored graphs or marks.

#include <cstdint>
#include <type_traits>

#include "rt_core/base/scalar.hpp"
#include "rt_core/scene/scene_format.hpp"

namespace haptic {

/// Whether the envelope of a scene is one orientation.
[[nodiscard]] constexpr bool is_one_orientation(const EnvelopeParameters& e) noexcept {
  return (e.given & kOrientationGiven) != 0 && e.max_angle_rad == 0;
}

/// Which part of a plane can carry a force.
enum class PlaneForce : std::uint8_t {
  kHidden = 0,    ///< nothing: a cut has made it, or the part goes on in another piece all along it
  kBears = 1,     ///< some basic contact that has the gap
  kElsewhere = 2  ///< of a face: others of its basic contacts, which do not have the gap
};

/// A plane of a C-obstacle. The gap along it, normal . y - offset_m, is that between the supports
/// of the two pieces: for every y a lower bound of the signed distance.
struct FixedPlane {
  Real normal[3];  ///< outward, unit, W axes
  Real offset_m;
  std::uint32_t node_begin;  ///< near nodes on it: in kFixedNodes, counted from those of the pair
  std::uint32_t node_count;
  std::uint16_t i, j;  ///< basic contact of the gap: its features of A and B
  std::uint8_t type;   ///< ContactType: type A a face of A, B a face of B, C two edges
  std::uint8_t force;  ///< PlaneForce
  std::uint16_t reserved;
};

/// A basic contact that can be near and carry a force: its violation is below the scene's epsilon,
/// its value the gap along its plane plus `rise_m`, less than kMaxRise epsilon.
struct FixedNode {
  std::uint16_t i, j;
  std::uint32_t type;        ///< ContactType: that of its plane, or C
  Real rise_m, violation_m;  ///< as in NearNode; rise_m also of type C
};

/// The C-obstacle of one pair, by pair. Planes come in four runs: those of all faces of A, of all
/// faces of B, of the edge pairs that apply, which together bound the C-obstacle, and of edge pairs
/// that do not apply but can be near. Edge pairs that apply in a plane that is listed already stand
/// among its nodes.
struct FixedPairRecord {
  std::uint32_t plane_begin, plane_count;
  std::uint32_t bounding_count;  ///< planes of the first three runs
  std::uint32_t node_begin, node_count;
  std::uint32_t hidden;  ///< 1: some basic contact only separates
};

[[nodiscard]] constexpr bool has_force(const FixedPlane& plane, PlaneForce force) noexcept {
  return plane.force == static_cast<std::uint8_t>(force);
}

static_assert(sizeof(FixedPlane) == 4 * sizeof(Real) + 16 &&
              sizeof(FixedNode) == 8 + 2 * sizeof(Real) && sizeof(FixedPairRecord) == 24);
static_assert(std::is_trivially_copyable_v<FixedPlane> && std::is_trivially_copyable_v<FixedNode>);

}  // namespace haptic
