// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Inside of find_near_set: the search of one pair in one tick. Not for inclusion outside
/// tracking/near_*.cpp: near_set.cpp has its order, the proof and the result, near_faces.cpp faces
/// and the nodes on them, near_edges.cpp edges and their pairs.

#include <algorithm>
#include <cmath>
#include <limits>

#include "rt_core/tracking/near_set.hpp"

namespace haptic {

/// One search. Functions marked inline are defined, and called, in one of those files alone.
class NearSearch {
 public:
  NearSearch(const PairPose& pose, Real epsilon_m, FeatureBounds& bounds, NearScratch& scratch,
             BoundedList<NearNode>& near, NodeScope scope) noexcept;

  [[nodiscard]] NearResult run() noexcept;
  /// D_near and its node alone: the near nodes are not collected.
  [[nodiscard]] NearResult run_for_nearest() noexcept;

 private:
  static constexpr Real kLowest = kNoDepth;

  // --- Faces (near_faces.cpp) ------------------------------------------------------------------

  /// Start value: last tick's best face. It only raises L.
  void seed_face() noexcept;
  void search_faces() noexcept;
  /// Where the climb for a face's support starts: its own last one, or, before it has one, that of
  /// a face next to it.
  [[nodiscard]] static inline std::uint32_t support_start(const PieceView& piece,
                                                          const PieceKeys& keys,
                                                          std::uint32_t f) noexcept;
  /// Only nodes that carry force are looked at.
  [[nodiscard]] bool is_live() const noexcept { return scope_ == NodeScope::kLive; }
  /// A face or edge, by its number in the marks, has a node in the scope.
  [[nodiscard]] bool in_scope(std::uint32_t feature) const noexcept {
    return !is_live() || marks_.feature(scope_, feature);
  }
  /// The gap of a face is the value of a node in the scope: of its support vertex, or of one that
  /// ties with it. Cost: one bit, or the vertices that tie.
  [[nodiscard]] inline bool counts(bool of_a, std::uint32_t f, std::uint32_t support,
                                   const Vec3& n) noexcept;
  inline void evaluate_face_a(std::uint32_t f) noexcept;
  inline void evaluate_face_b(std::uint32_t f) noexcept;
  inline void take_face(PieceKeys& keys, std::uint32_t f, std::uint32_t support, Real gap,
                        bool of_a, const Vec3& n) noexcept;
  void collect_near_faces() noexcept;
  /// Near nodes (F_A, v): walks the graph over the neighbors that keep the face.
  inline void walk_face_a(const TouchedFace& touched, Real below) noexcept;
  /// Near nodes (v, F_B).
  inline void walk_face_b(const TouchedFace& touched, Real below) noexcept;
  /// Visits the vertices with f < below from the support vertex on, over the arcs of the graph that
  /// keep the face, and takes those that are near. Each vertex comes once.
  template <typename ValueAt>
  void walk(ContactType type, const TouchedFace& touched, const ValueAt& value_at, const Vec3& n,
            Real below) noexcept;
  inline void push_face_node(ContactType type, const TouchedFace& touched, std::uint32_t vertex,
                             const Vec3& n, Real f, Real violation) noexcept;

  // --- Edges and their pairs (near_edges.cpp) --------------------------------------------------

  struct PairHeights {
    Real c0, c1;  ///< of B's apexes, times the sine
    Real d0, d1;  ///< of A's
    Real height;  ///< the violation, times the sine
    Real sine, sign;
    bool collect;  ///< the pair may join the near set
  };

  /// Start value: last tick's best edge pair, where it still applies. It only raises L.
  void seed_edge_pair() noexcept;
  void search_edges() noexcept;
  [[nodiscard]] bool matters(const PieceKeys& keys, std::uint32_t e) const noexcept {
    return keys.edges.key[e] + keys.odometer >= best_.value - slack_.edges_m;
  }
  /// An edge's bound is not computed again before the odometer has gone on by epsilon.
  [[nodiscard]] bool old(const PieceKeys& keys, std::uint32_t e) const noexcept {
    return keys.edges.key[e] == kStaleKey || keys.odometer - keys.edge_stamp[e] > epsilon_;
  }
  inline void store_edge(PieceKeys& keys, std::uint32_t e, Real bound) noexcept;
  /// Bound on s(n) over the arc of an edge of B: s(n) <= n.(y + a - b0) for any vertex a of A.
  [[nodiscard]] inline Real bound_edge_b(std::uint32_t e) const noexcept;
  /// The same for an edge of A, in A's axes: n = -R m, s(n) <= m.(R^T (b - y) - a0).
  [[nodiscard]] inline Real bound_edge_a(std::uint32_t e) const noexcept;
  [[nodiscard]] inline ActiveEdge active_edge_a(std::uint32_t e) const noexcept;
  [[nodiscard]] inline ActiveEdge active_edge_b(std::uint32_t e) const noexcept;
  void test_edge_pairs() noexcept;
  /// Tests an edge of B against the active edges of A whose node is in the scope; false: no more
  /// may be tested.
  [[nodiscard]] inline bool test_marked(const ActiveEdge& b, std::uint32_t capacity) noexcept;
  /// Sorts out what cannot be near, without a division or a root: c and d are the heights of the
  /// apexes over the plane spanned by the two edges, times the sine of their angle. With
  /// v0 -> v1 counter-clockwise round face[0], the violation of n = +-(u x v) / |u x v| is the
  /// largest of +-c0, -+c1, +-d0, -+d1.
  inline void test_pair(const ActiveEdge& a, const ActiveEdge& b, bool collect) noexcept;
  inline void take_pair(const ActiveEdge& a, const ActiveEdge& b, const PairHeights& h,
                        const Vec3& m, const Vec3& w) noexcept;
  /// Largest height that one of the pieces rises over the plane of an edge pair, where its apex
  /// does not tell; else a height that the apexes have.
  [[nodiscard]] inline Real rise(const NearNode& node, const PairHeights& h, const EdgeArc* arc_a,
                                 const EdgeArc* arc_b) noexcept;
  /// The value of an applicable pair: f itself where the heights leave no doubt, for then the edges
  /// are the supports; else the gap along n, which is a lower bound for any n.
  inline void count_pair(const NearNode& node, const PairHeights& h) noexcept;
  inline void collect_edge_pair(const NearNode& node) noexcept;
  /// D_near is known now: the candidates that are not near leave.
  void keep_near_edge_pairs() noexcept;

  // --- Keys, order and result (near_set.cpp) ---------------------------------------------------

  /// A key only falls: the new bound and the old one raised by the motion since are both bounds.
  void store_key(const PieceKeys& keys, Real& key, Real bound) noexcept {
    const Real fresh = (bound - keys.odometer) + pose_.rounding_m +
                       4 * kRealEpsilon * (std::abs(bound) + keys.odometer);
    key = std::min(key, fresh);
  }
  /// Makes `keys.shortlist` hold every feature with key >= limit. It stays valid while the limit
  /// stays above where it was made, because keys only fall.
  void list(FeatureKeys& keys, Real limit) noexcept {
    if (limit >= keys.listed_above && limit <= keys.listed_above + 4 * kShortlistSlack_m) return;
    make_list(keys, limit - kShortlistSlack_m);
  }
  /// Lists every feature with key >= above.
  static void make_list(FeatureKeys& keys, Real above) noexcept;
  /// The lists of a tick in which everything was evaluated hold everything: made again next time.
  inline void forget_shortlists() noexcept;
  /// Among ties a face: its normal is exact.
  inline void choose_best() noexcept;
  /// Two values differ by rounding alone.
  [[nodiscard]] bool ties(Real l, Real r) const noexcept {
    return std::abs(l - r) <= slack_.tie_a_m + slack_.tie_b_m;
  }
  [[nodiscard]] bool is_near(Real f, Real violation) const noexcept {
    return std::abs(f - best_.value) + std::max(violation, Real{0}) < epsilon_;
  }

  /// How far apart values and bounds may be that count as one.
  struct Slack {
    Real heights_m;             ///< below it the sign of a height may be rounding
    Real tie_a_m, tie_b_m;      ///< rounding of a vertex's height over another of A, of B
    Real edges_m;               ///< how far below D_near the bound of an edge of a near node can be
    Real faces_a_m, faces_b_m;  ///< the same of the faces of A and B
  };
  /// The best values so far [m].
  struct Best {
    Real value = kLowest;  ///< L, of all
    Real gap_a = kLowest, gap_b = kLowest;
    std::uint32_t face_a = 0, face_b = 0;
    Real pair_value = kLowest;
    NearNode pair;
    SupportPair pair_support;
  };

  const PairPose& pose_;
  const PieceView& a_;
  const PieceView& b_;
  NodeNumbering numbers_;
  NodeMarks marks_;
  NodeScope scope_;
  Real epsilon_;
  Slack slack_;
  FeatureBounds& bounds_;
  SearchStart& start_;
  NearScratch& scratch_;
  BoundedList<NearNode>& near_;
  std::uint32_t near_begin_, near_end_;
  std::uint32_t seed_a_ = UINT32_MAX, seed_b_ = UINT32_MAX;  ///< faces evaluated as seeds
  Best best_;
  Real compacted_at_ = kLowest;
  bool collects_ = true;
  NearResult result_;
};

}  // namespace haptic
