// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The valid set of one pair: every C-face plane that a free configuration lies outside of. Found
/// by walking the contact graph from the plane that last certified the pair.
///
/// Why the walk finds them. The C-faces that see a point outside a convex polyhedron are connected
/// across its edges, and arcs of the graph join C-faces that share an edge, so the walk over valid
/// nodes reaches all of them from one. One is always at hand: let n be a direction with a gap and
/// (a, b) its support vertices. n lies in the cell of directions with these supports, whose corners
/// are normals of applicable nodes at a and b; n is a sum of corners with weights >= 0 that add up
/// to 1 or more, and on the cell the gap is linear, so the gap of some corner is not below the
/// smaller of n's and zero. So where the certificate's own node has ceased to apply, the nodes at
/// its support vertices hold a valid one.

#include <cstdint>
#include <span>

#include "rt_core/base/arena.hpp"
#include "rt_core/contact/c_face_plane.hpp"
#include "rt_core/contact/pair_pose.hpp"
#include "rt_core/scene/capacity.hpp"
#include "rt_core/scene/scene_traits.hpp"

namespace haptic {

/// A plane that x lies outside of, within the tolerance of the search.
struct ValidPlane {
  PlaneId id;
  SupportPair support;
  Real gap_m = 0;
};

/// Nodes that a search looks at: all of the largest pair, where an image's scene has no more than
/// kMaxValidVisits.
inline constexpr std::uint32_t kValidVisits = kSceneTraits.valid_visits;
static_assert(kValidVisits > 0 && kValidVisits <= kMaxValidVisits);

struct ValidScratch {
  std::span<std::uint32_t> slots;  ///< open table of nodes seen, plus one; zero between uses
  std::span<std::uint32_t> queue;  ///< kValidVisits nodes
  std::span<std::uint16_t> used;   ///< slots taken
  void place(Arena& arena) noexcept;
};

struct ValidResult {
  std::uint32_t count = 0;    ///< planes written
  std::uint32_t exposed = 0;  ///< of these, the first: those that can carry a force
  std::uint32_t visited = 0;  ///< nodes looked at
  bool cut = false;           ///< the walk or the room ended before the set did
};

/// Valid planes of the pair at `pose`, at most kMaxValidPlanes: applicable nodes with a gap of at
/// least `least_gap_m`, one entry per plane; first those that can carry a force, of each kind those
/// of faces before those of edge pairs. Beyond the room the last leave first (a subset is only
/// stricter). `seed` is a plane with a gap of at least that at
/// `pose`, `support` its support vertices there. No plane found: the seed was none. Cost: at most
/// kValidVisits nodes, each a plane, its neighbors and at most one support pair.
[[nodiscard]] ValidResult find_valid_planes(const PairPose& pose, const PlaneId& seed,
                                            SupportPair support, Real least_gap_m,
                                            const ValidScratch& scratch,
                                            std::span<ValidPlane> planes) noexcept;

/// True if the edge pair of a type-C plane, with its normal, is a C-face at this orientation. Types
/// A and B: always. Cost: four dot products.
[[nodiscard]] bool plane_applies(const PairView& pair, const Mat3& r_wa,
                                 const PlaneId& id) noexcept;

}  // namespace haptic
