// SPDX-License-Identifier: Apache-2.0
#include "rt_core/tracking/near_set.hpp"

#include <algorithm>

#include "rt_core/tracking/near_search.hpp"

// Why nothing is missed. Write s(n) for the gap along n, D for D_near, L <= D for the largest value
// of a face direction or an applicable edge pair found so far in this tick, eps for epsilon.
//
// 1. D itself. D is the value of a face direction, or of an applicable edge pair, whose normal lies
//    in the arc of its B edge and in the turned arc of its A edge. A face that carries D has
//    key + odometer >= D >= L; an edge that takes part in it has an arc with
//    max over the arc of s >= D >= L, and its key bounds that maximum. So it is looked at.
// 2. Type C of the near set. Let the node (e_A, e_B) have |f - D| + v < eps, v >= 0 its violation:
//    the larger of the heights that the two pieces rise over the plane. The apex of an adjoining
//    face of depth w rises by w sin(t), t the angle by which n has left the arc, so w sin(t) < eps
//    and n lies in the stored arc, which reaches asin(eps / w) beyond each end. The gap along n is
//    f less the two heights: s(n) >= f - 2 v > D - eps + v - 2 v > D - 2 eps, and the keys of both
//    edges bound s(n).
// 3. Types A and B. Let the node (v_A, F_B) have |f - D| + v < eps. Its plane is F_B's, so B does
//    not rise over it, and A sinks below it by at most g(v), the largest rise of A's piece in a
//    direction in which no neighbour of v_A rises by more than v. So s(n_FB) >= f - g(v) >
//    D - eps + v - g(v), and the compiler has bounded eps + g(v) - v over 0 <= v < eps
//    (vertex_relax_m of A's piece); or by the definition f - s(n_FB) < kMaxRise eps, whichever is
//    less. The same for type A with B's piece.
// 4. Within a face. The vertices with f < D + eps are a sublevel set of a linear function on a
//    convex polyhedron: connected by edges and holding the support vertex, where the walk starts.

namespace haptic {

NearSearch::NearSearch(const PairPose& pose, Real epsilon_m, FeatureBounds& bounds,
                       NearScratch& scratch, BoundedList<NearNode>& near, NodeScope scope) noexcept
    : pose_(pose),
      a_(pose.pair->a),
      b_(pose.pair->b),
      numbers_(numbering(a_, b_)),
      marks_(pose.pair->marks),
      scope_(scope),
      epsilon_(epsilon_m),
      slack_{64 * kRealEpsilon * pose.size_m,
             height_rounding(*a_.record),
             height_rounding(*b_.record),
             2 * epsilon_m,
             std::min(static_cast<Real>(b_.record->vertex_relax_m), (kMaxRise + 1) * epsilon_m),
             std::min(static_cast<Real>(a_.record->vertex_relax_m), (kMaxRise + 1) * epsilon_m)},
      bounds_(bounds),
      start_(is_live() ? bounds.live : bounds.start),
      scratch_(scratch),
      near_(near),
      near_begin_(near.size()),
      near_end_(near.size() + pose.pair->record.near_capacity) {
  scratch_.touched.clear();
  scratch_.active_a.clear();
  scratch_.active_b.clear();
}

NearResult NearSearch::run() noexcept {
  const bool all_stale = bounds_.stale;
  best_.face_a = start_.face_a;
  best_.face_b = start_.face_b;
  if (!bounds_.stale && start_.known) {
    if (start_.is_edges) seed_edge_pair();
    seed_face();
  }
  search_faces();
  search_edges();
  test_edge_pairs();
  choose_best();
  keep_near_edge_pairs();
  collect_near_faces();
  if (is_live()) return result_;  // the pair's search before has the rest
  bounds_.stale = false;
  if (all_stale || result_.feature_evaluations >= bounds_.needed) {
    result_.flags |= kNearAllStale;
    forget_shortlists();
  }
  return result_;
}

NearResult NearSearch::run_for_nearest() noexcept {
  collects_ = false;
  search_faces();
  search_edges();
  test_edge_pairs();
  choose_best();
  return result_;
}

void NearSearch::make_list(FeatureKeys& keys, Real above) noexcept {
  keys.listed_above = above;
  std::uint32_t listed = 0;
  for (std::uint32_t k = 0; k < keys.key.size(); k += kLanes) {
    RealLanes lanes;
    load_lanes(keys.key.data() + k, lanes);
    const LaneMask matters = lanes >= above;
    if (!any_lane(matters)) continue;
    for (std::uint32_t l = 0; l < kLanes; ++l) {
      if (matters[l] != 0 && k + l < keys.shortlist.size()) {
        keys.shortlist[listed++] = static_cast<std::uint16_t>(k + l);
      }
    }
  }
  keys.listed = listed;
}

void NearSearch::forget_shortlists() noexcept {
  for (FeatureKeys* keys :
       {&bounds_.a.faces, &bounds_.a.edges, &bounds_.b.faces, &bounds_.b.edges}) {
    keys->listed_above = kStaleKey;
  }
}

void NearSearch::choose_best() noexcept {
  result_.d_near_m = best_.value;
  if (best_.value == kNoDepth) return;
  const Real best_face = std::max(best_.gap_a, best_.gap_b);
  const bool is_edges = best_.pair_value > best_face + slack_.heights_m;
  const bool is_of_a = !(best_.gap_b > best_.gap_a + slack_.heights_m);
  start_.is_edges = is_edges;
  start_.face_a = best_.face_a;
  start_.face_b = best_.face_b;
  start_.known = true;
  if (is_edges) {
    start_.edge_a = best_.pair.i;
    start_.edge_b = best_.pair.j;
    result_.best = best_.pair;
    result_.attained = ties(best_.pair.f_m, best_.value);
    result_.support = best_.pair_support;
    return;
  }
  result_.attained = ties(is_of_a ? best_.gap_a : best_.gap_b, best_.value);
  start_.is_of_a = is_of_a;
  NearNode& best = result_.best;
  if (!is_of_a) {
    const std::uint32_t f = best_.face_b;
    const std::uint32_t v = bounds_.b.face_support[f];
    best.type = ContactType::kB;
    best.i = static_cast<std::uint16_t>(v);
    best.j = static_cast<std::uint16_t>(f);
    best.node = numbers_.type_b(v, f);
    best.normal_w = b_.face_normal(f);
    best.f_m = best_.gap_b;
    result_.support = {v, b_.face_vertices(f)[0]};
  } else {
    const std::uint32_t f = best_.face_a;
    const std::uint32_t v = bounds_.a.face_support[f];
    best.type = ContactType::kA;
    best.i = static_cast<std::uint16_t>(f);
    best.j = static_cast<std::uint16_t>(v);
    best.node = numbers_.type_a(f, v);
    best.normal_w = -pose_.normal_a(f);
    best.f_m = best_.gap_a;
    result_.support = {a_.face_vertices(f)[0], v};
  }
}

void NearScratch::Size::fit(const PieceRecord& a, const PieceRecord& b) noexcept {
  faces = std::max(faces, a.face_count + b.face_count);
  edges_a = std::max(edges_a, a.edge_count);
  edges_b = std::max(edges_b, b.edge_count);
  vertices = std::max({vertices, a.vertex_count, b.vertex_count});
}

void NearScratch::place(Arena& arena, const Size& size) noexcept {
  touched = BoundedList<TouchedFace>(arena.take<TouchedFace>(size.faces));
  active_a = BoundedList<ActiveEdge>(arena.take<ActiveEdge>(size.edges_a));
  active_b = BoundedList<ActiveEdge>(arena.take<ActiveEdge>(size.edges_b));
  queue = arena.take<std::uint16_t>(size.vertices);
  marks = arena.take<std::uint64_t>((std::size_t{size.vertices} + 63) / 64);
}

NearResult find_near_set(const PairPose& pose, Real epsilon_m, FeatureBounds& bounds,
                         NearScratch& scratch, BoundedList<NearNode>& near,
                         NodeScope scope) noexcept {
  return NearSearch(pose, epsilon_m, bounds, scratch, near, scope).run();
}

NearResult find_nearest(const PairPose& pose, FeatureBounds& bounds,
                        NearScratch& scratch) noexcept {
  BoundedList<NearNode> none;
  return NearSearch(pose, 0, bounds, scratch, none, NodeScope::kReachable).run_for_nearest();
}

}  // namespace haptic
