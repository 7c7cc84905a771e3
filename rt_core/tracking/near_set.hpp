// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The nearest C-faces of one C-obstacle, exactly and completely, in every tick (paper Sec. III).
/// D_near is the largest value over all applicable basic contacts; the near set holds every basic
/// contact within epsilon of it. Faces and edges keep stale upper bounds of what they can carry
/// (tracking/feature_bounds.hpp): what is not looked at provably cannot matter.

#include <cstdint>
#include <limits>
#include <span>

#include "rt_core/base/bounded_list.hpp"
#include "rt_core/contact/basic_contact.hpp"
#include "rt_core/tracking/feature_bounds.hpp"

namespace haptic {

/// A vertex this many epsilon above the support of a face is not near it, however flat its
/// neighbours are: only where edges are hardly longer than epsilon does the rule have to be called.
inline constexpr Real kMaxRise = 4;

/// A node of the near set: |D_near - f| + max(violation, 0) < epsilon, and rise < kMaxRise epsilon.
struct NearNode {
  std::uint32_t node = 0;  ///< number in the pair
  ContactType type = ContactType::kA;
  std::uint16_t i = 0, j = 0;    ///< features of A and B
  Vec3 normal_w = Vec3::Zero();  ///< outward unit normal of the C-face
  Real f_m = 0;                  ///< n.((x - b) + R a)
  /// Types A and B: largest height of a neighbouring vertex over the plane (METHOD section 2). Type
  /// C: the larger of the heights that the two pieces rise over it. <= 0: applicable.
  Real violation_m = 0;
  /// App on B about x_0^A, W axes, and how far it lies outside its two features when A is moved to
  /// the SCP; filled where the pair collides [m].
  Vec3 app_w = Vec3::Zero();
  Real outside_m = 0;
};

/// D_near of a search that met no node that counts.
inline constexpr Real kNoDepth = -std::numeric_limits<Real>::max();

enum NearFlag : std::uint32_t {
  kNearAllStale = 1u << 0,      ///< every face and edge was evaluated: first tick, or a jump
  kNearSetCut = 1u << 1,        ///< more near nodes than room
  kNearEdgePairsCut = 1u << 2,  ///< more pairs of edges than may be tested: D_near is a lower bound
  kNearSupportsCut = 1u << 3    ///< the same of support pairs
};

/// What one search returns.
struct NearResult {
  Real d_near_m = 0;     ///< largest value: D_near, or a lower bound of it when edge pairs were cut
  NearNode best;         ///< node of D_near; among ties a face, then the lowest number
  bool attained = true;  ///< D_near is the value of `best` to rounding, not one within a tolerance
  SupportPair support;   ///< support vertices along its normal: with them d_near_m certifies itself
  std::uint32_t flags = 0;  ///< NearFlag
  std::uint32_t feature_evaluations = 0;
  std::uint32_t edge_pairs = 0;
  std::uint32_t support_pairs = 0;
};

/// A face whose gap was computed in this search.
struct TouchedFace {
  Real gap_m = 0;
  std::uint16_t face = 0;
  bool of_a = false;
};

/// An edge whose arc may carry a value that matters, at the current pose.
struct ActiveEdge {
  Vec3 direction_w;              ///< unit
  Vec3 origin_w;                 ///< its first vertex, about B's reference [m]
  Vec3 other_axes;               ///< B's edge: its direction in A's axes
  const EdgeArc* arc = nullptr;  ///< null of a facet
  std::uint16_t edge = 0;
};

/// Rounding of the height of one vertex of a piece over another along a unit vector: each is
/// stored, turned and projected, which rounds it by less than five epsilons of its distance from
/// the reference [m].
[[nodiscard]] inline Real height_rounding(const PieceRecord& piece) noexcept {
  return 10 * kRealEpsilon * static_cast<Real>(piece.reach_m);
}

/// Memory of one search, shared by all pairs of a scene.
struct NearScratch {
  BoundedList<TouchedFace> touched;
  BoundedList<ActiveEdge> active_a, active_b;
  std::span<std::uint16_t> queue;  ///< vertices of a face's neighborhood
  std::span<std::uint64_t> marks;  ///< a bit per vertex; zero between uses

  /// Room for any pair of the pieces given so far; call `place` once after `fit` of every pair.
  struct Size {
    std::uint32_t faces = 0, edges_a = 0, edges_b = 0, vertices = 0;
    void fit(const PieceRecord& a, const PieceRecord& b) noexcept;
  };
  void place(Arena& arena, const Size& size) noexcept;
};

/// Finds D_near at `pose` over the nodes of the scope and appends the live nodes near it to `near`,
/// in the order in which the search met them. Scope kLive measures what carries force: of a face
/// only where its support is a live node, or a live one ties with it; where no live node applies,
/// d_near_m is kNoDepth. Both scopes keep the same bounds.
///
/// `epsilon_m` must be the scene's, `bounds` must have been advanced to this pose. Exact at
/// every pose of the envelope that the marks were made for, regardless of the motion since the last
/// call. Cost: at most every face and edge of the scope once, the pair's edge_pair_capacity edge
/// pairs and near_capacity near nodes; typically a handful of each.
[[nodiscard]] NearResult find_near_set(const PairPose& pose, Real epsilon_m, FeatureBounds& bounds,
                                       NearScratch& scratch, BoundedList<NearNode>& near,
                                       NodeScope scope = NodeScope::kReachable) noexcept;

/// D_near and its node alone, without history: `bounds` must have been reset. Cost: every reachable
/// face and edge once, the pair's edge_pair_capacity edge pairs, each some eighth of a face, and
/// kMaxNearestSupports support pairs. The pair must not be that of a part that never turns.
[[nodiscard]] NearResult find_nearest(const PairPose& pose, FeatureBounds& bounds,
                                      NearScratch& scratch) noexcept;

}  // namespace haptic
