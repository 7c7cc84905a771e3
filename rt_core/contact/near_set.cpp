// SPDX-License-Identifier: Apache-2.0
#include "rt_core/contact/near_set.hpp"

#include <algorithm>
#include <cmath>

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
// convex
//    polyhedron: connected by edges and holding the support vertex, where the walk starts.

namespace haptic {
namespace {

constexpr Real kLowest = -std::numeric_limits<Real>::max();

/// Edges closer to parallel than this carry no type-C value: their C-face is a strip narrower than
/// the rounding of its neighbours (method section 11).
constexpr Real kParallelSine = HAPTIC_REAL_IS_FLOAT ? 1.0e-5_r : 1.0e-12_r;
/// Below this sine an applicable normal is taken from the two face normals of B's edge, between
/// which it lies, instead of the cross product, which has lost its digits.
constexpr Real kLerpSine = HAPTIC_REAL_IS_FLOAT ? 1.0e-2_r : 1.0e-6_r;

/// Largest n.w over the unit directions n of an arc. Cost: two dots and a root.
Real arc_peak(const EdgeArc& arc, const Vec3& w) noexcept {
  const Real p = ConstVec3Map(arc.mid).dot(w);
  const Real q = std::abs(ConstVec3Map(arc.side).dot(w));
  if (p * arc.sine - q * arc.cosine >= 0) return std::sqrt(p * p + q * q);  // the peak is inside
  return p * arc.cosine + q * arc.sine;
}

/// Largest min(n.v, n.w) over the unit directions n of an arc: attained at an end, at a peak of one
/// of the two, or where they cross. Never above the smaller of both peaks. Cost: three roots.
Real arc_peak_of_both(const EdgeArc& arc, const Vec3& v, const Vec3& w) noexcept {
  const ConstVec3Map mid(arc.mid), side(arc.side);
  const Real vp = mid.dot(v), vq = side.dot(v), wp = mid.dot(w), wq = side.dot(w);
  const auto lower = [&](Real p, Real q) { return std::min(vp * p + vq * q, wp * p + wq * q); };
  Real peak = std::max(lower(arc.cosine, arc.sine), lower(arc.cosine, -arc.sine));
  const auto consider = [&](Real p, Real q) {                 // along the direction p mid + q side
    if (p * arc.sine - std::abs(q) * arc.cosine < 0) return;  // beyond the arc
    const Real length = std::sqrt(p * p + q * q);
    if (length > 0) peak = std::max(peak, lower(p, q) / length);
  };
  consider(vp, vq);
  consider(wp, wq);
  consider(wq - vq, vp - wp);
  consider(vq - wq, wp - vp);
  return peak;
}

/// The search of one pair in one tick.
class NearSearch {
 public:
  NearSearch(const PairPose& pose, Real epsilon_m, FeatureBounds& bounds, NearScratch& scratch,
             BoundedList<NearNode>& near) noexcept
      : pose_(pose),
        a_(pose.pair->a),
        b_(pose.pair->b),
        numbers_(numbering(a_, b_)),
        epsilon_(epsilon_m),
        tolerance_(64 * kRealEpsilon * pose.size_m),
        relax_edges_(2 * epsilon_m),
        relax_a_(
            std::min(static_cast<Real>(b_.record->vertex_relax_m), (kMaxRise + 1) * epsilon_m)),
        relax_b_(
            std::min(static_cast<Real>(a_.record->vertex_relax_m), (kMaxRise + 1) * epsilon_m)),
        bounds_(bounds),
        scratch_(scratch),
        near_(near),
        near_begin_(near.size()),
        near_end_(near.size() + pose.pair->record->near_capacity) {
    scratch_.touched.clear();
    scratch_.active_a.clear();
    scratch_.active_b.clear();
  }

  [[nodiscard]] NearResult run() noexcept {
    const bool all_stale = bounds_.stale;
    seed();
    search_faces();
    search_edges();
    test_edge_pairs();
    choose_best();
    keep_near_edge_pairs();
    collect_near_faces();
    bounds_.stale = false;
    if (all_stale || result_.feature_evaluations >= feature_count()) {
      result_.flags |= kNearAllStale;
      forget_shortlists();
    }
    return result_;
  }

 private:
  // --- Faces -----------------------------------------------------------------------------------

  /// Start value: last tick's best feature, where it still applies. It only raises L.
  void seed() noexcept {
    if (bounds_.stale) return;
    if (bounds_.best_is_edges) {
      test_pair(active_edge_a(bounds_.best_edge_a), active_edge_b(bounds_.best_edge_b), false);
    }
    if (bounds_.best_is_of_a) {
      seed_a_ = bounds_.best_face_a;
      evaluate_face_a(bounds_.best_face_a);
    } else {
      seed_b_ = bounds_.best_face_b;
      evaluate_face_b(bounds_.best_face_b);
    }
  }

  void search_faces() noexcept {
    list(bounds_.b.faces, best_ - relax_b_ - bounds_.b.odometer);
    for (std::uint32_t k = 0; k < bounds_.b.faces.listed; ++k) {
      const std::uint32_t f = bounds_.b.faces.shortlist[k];
      if (f == seed_b_) continue;
      if (bounds_.b.faces.key[f] + bounds_.b.odometer >= best_ - relax_b_) evaluate_face_b(f);
    }
    list(bounds_.a.faces, best_ - relax_a_ - bounds_.a.odometer);
    for (std::uint32_t k = 0; k < bounds_.a.faces.listed; ++k) {
      const std::uint32_t f = bounds_.a.faces.shortlist[k];
      if (f == seed_a_) continue;
      if (bounds_.a.faces.key[f] + bounds_.a.odometer >= best_ - relax_a_) evaluate_face_a(f);
    }
  }

  /// Where the climb for a face's support starts: its own last one, or, before it has one, that of
  /// a face beside it.
  [[nodiscard]] static std::uint32_t support_start(const PieceView& piece, const PieceKeys& keys,
                                                   std::uint32_t f) noexcept {
    if (keys.faces.key[f] < kStaleKey) return keys.face_support[f];
    for (const std::uint16_t e : piece.face_edges(f)) {
      const EdgeRecord& edge = piece.edges[e];
      const std::uint32_t other = edge.face[0] == f ? edge.face[1] : edge.face[0];
      if (keys.faces.key[other] < kStaleKey) return keys.face_support[other];
    }
    return 0;
  }

  void evaluate_face_a(std::uint32_t f) noexcept {
    const Vec3 n = -pose_.normal_a(f);
    const std::uint32_t v = highest_vertex_b(pose_, n, support_start(a_, bounds_.a, f));
    const Real gap = n.dot(pose_.y_w - pose_.vertex_b(v)) - a_.face_offset(f);
    take_face(bounds_.a, f, v, gap, true);
  }

  void evaluate_face_b(std::uint32_t f) noexcept {
    const Vec3 n = b_.face_normal(f);
    const std::uint32_t v = lowest_vertex_a(pose_, n, support_start(b_, bounds_.b, f));
    const Real gap = n.dot(pose_.y_w + pose_.vertex_a(v)) - b_.face_offset(f);
    take_face(bounds_.b, f, v, gap, false);
  }

  void take_face(PieceKeys& keys, std::uint32_t f, std::uint32_t support, Real gap,
                 bool of_a) noexcept {
    result_.feature_evaluations += 1;
    keys.face_support[f] = static_cast<std::uint16_t>(support);
    store_key(keys, keys.faces.key[f], gap);
    static_cast<void>(scratch_.touched.push({gap, static_cast<std::uint16_t>(f), of_a}));
    Real& best = of_a ? best_gap_a_ : best_gap_b_;
    std::uint32_t& best_face = of_a ? bounds_.best_face_a : bounds_.best_face_b;
    if (gap > best || (gap == best && f < best_face)) {
      best = gap;
      best_face = f;
    }
    best_ = std::max(best_, gap);
  }

  /// A key only falls: the new bound and the old one raised by the motion since are both bounds.
  void store_key(const PieceKeys& keys, Real& key, Real bound) noexcept {
    const Real fresh = (bound - keys.odometer) + pose_.rounding_m +
                       4 * kRealEpsilon * (std::abs(bound) + keys.odometer);
    key = std::min(key, fresh);
  }

  // --- Shortlists ------------------------------------------------------------------------------

  /// Makes `keys.shortlist` hold every feature with key >= limit. It stays valid while the limit
  /// stays above where it was made, because keys only fall.
  void list(FeatureKeys& keys, Real limit) noexcept {
    if (limit >= keys.listed_above && limit <= keys.listed_above + 4 * kShortlistSlack_m) return;
    const Real above = limit - kShortlistSlack_m;
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

  /// The lists of a tick in which everything was evaluated hold everything: made anew next time.
  void forget_shortlists() noexcept {
    for (FeatureKeys* keys :
         {&bounds_.a.faces, &bounds_.a.edges, &bounds_.b.faces, &bounds_.b.edges}) {
      keys->listed_above = kStaleKey;
    }
  }

  // --- Edges -----------------------------------------------------------------------------------

  void search_edges() noexcept {
    PieceKeys& b = bounds_.b;
    list(b.edges, best_ - relax_edges_ - b.odometer);
    for (std::uint32_t k = 0; k < b.edges.listed; ++k) {
      const std::uint32_t e = b.edges.shortlist[k];
      if (!matters(b, e)) continue;
      if (old(b, e)) store_edge(b, e, bound_edge_b(e));
      if (matters(b, e)) static_cast<void>(scratch_.active_b.push(active_edge_b(e)));
    }
    if (scratch_.active_b.empty()) return;  // no edge of B, no edge pair
    PieceKeys& a = bounds_.a;
    list(a.edges, best_ - relax_edges_ - a.odometer);
    for (std::uint32_t k = 0; k < a.edges.listed; ++k) {
      const std::uint32_t e = a.edges.shortlist[k];
      if (!matters(a, e)) continue;
      if (old(a, e)) store_edge(a, e, bound_edge_a(e));
      if (matters(a, e)) static_cast<void>(scratch_.active_a.push(active_edge_a(e)));
    }
  }

  [[nodiscard]] bool matters(const PieceKeys& keys, std::uint32_t e) const noexcept {
    return keys.edges.key[e] + keys.odometer >= best_ - relax_edges_;
  }
  /// An edge's bound is not computed again before the odometer has gone on by epsilon.
  [[nodiscard]] bool old(const PieceKeys& keys, std::uint32_t e) const noexcept {
    return keys.edges.key[e] == kStaleKey || keys.odometer - keys.edge_stamp[e] > epsilon_;
  }
  void store_edge(PieceKeys& keys, std::uint32_t e, Real bound) noexcept {
    result_.feature_evaluations += 1;
    keys.edge_stamp[e] = keys.odometer;
    store_key(keys, keys.edges.key[e], bound);
  }

  /// Bound on s(n) over the arc of an edge of B: s(n) <= n.(y + a - b0) for any vertex a of A.
  [[nodiscard]] Real bound_edge_b(std::uint32_t e) const noexcept {
    const EdgeRecord& edge = b_.edges[e];
    const Vec3 from = pose_.y_w - pose_.vertex_b(edge.vertex[0]);
    const std::uint32_t v0 = bounds_.b.face_support[edge.face[0]];
    const std::uint32_t v1 = bounds_.b.face_support[edge.face[1]];
    const Real bound = arc_peak(b_.arcs[e], from + pose_.vertex_a(v0));
    if (v0 == v1 || bound < best_ - relax_edges_) return bound;
    return arc_peak_of_both(b_.arcs[e], from + pose_.vertex_a(v0), from + pose_.vertex_a(v1));
  }

  /// The same for an edge of A, in A's axes: n = -R m, s(n) <= m.(R^T (b - y) - a0).
  [[nodiscard]] Real bound_edge_a(std::uint32_t e) const noexcept {
    const EdgeRecord& edge = a_.edges[e];
    const Vec3 a0 = a_.vertex(edge.vertex[0]);
    const std::uint32_t v0 = bounds_.a.face_support[edge.face[0]];
    const std::uint32_t v1 = bounds_.a.face_support[edge.face[1]];
    const auto from = [&](std::uint32_t v) -> Vec3 {
      return pose_.r_wa.transpose() * (pose_.vertex_b(v) - pose_.y_w) - a0;
    };
    const Vec3 w0 = from(v0);
    const Real bound = arc_peak(a_.arcs[e], w0);
    if (v0 == v1 || bound < best_ - relax_edges_) return bound;
    return arc_peak_of_both(a_.arcs[e], w0, from(v1));
  }

  [[nodiscard]] ActiveEdge active_edge_a(std::uint32_t e) const noexcept {
    ActiveEdge active;
    active.direction_w = pose_.direction_a(e);
    active.origin_w = pose_.y_w + pose_.vertex_a(a_.edges[e].vertex[0]);
    active.arc = &a_.arcs[e];
    active.edge = static_cast<std::uint16_t>(e);
    return active;
  }
  [[nodiscard]] ActiveEdge active_edge_b(std::uint32_t e) const noexcept {
    ActiveEdge active;
    active.direction_w = ConstVec3Map(b_.edge_directions[e].unit);
    active.other_axes = pose_.r_wa.transpose() * active.direction_w;
    active.origin_w = pose_.vertex_b(b_.edges[e].vertex[0]);
    active.arc = &b_.arcs[e];
    active.edge = static_cast<std::uint16_t>(e);
    return active;
  }

  // --- Edge pairs ------------------------------------------------------------------------------

  void test_edge_pairs() noexcept {
    const std::uint32_t capacity = pose_.pair->record->edge_pair_capacity;
    for (const ActiveEdge& b : scratch_.active_b) {
      if (result_.edge_pairs + scratch_.active_a.size() > capacity) {
        result_.flags |= kNearEdgePairsCut;
        return;
      }
      result_.edge_pairs += scratch_.active_a.size();
      for (const ActiveEdge& a : scratch_.active_a) test_pair(a, b, true);
    }
  }

  /// Sorts out what cannot be near, without a division or a root: c and d are the heights of the
  /// apexes over the plane spanned by the two edges, times the sine of their angle. With
  /// v0 -> v1 counter-clockwise round face[0], the violation of n = +-(u x v) / |u x v| is the
  /// largest of +-c0, -+c1, +-d0, -+d1.
  void test_pair(const ActiveEdge& a, const ActiveEdge& b, bool collect) noexcept {
    const Vec3& u = a.direction_w;
    const Vec3& v = b.direction_w;
    const Real c0 = ConstVec3Map(b.arc->tilt[0]).dot(u), c1 = ConstVec3Map(b.arc->tilt[1]).dot(u);
    const Real least_c = std::min(std::max(c0, -c1), std::max(-c0, c1));
    if (least_c >= epsilon_ && least_c > tolerance_) return;  // the sine is at most 1
    const Real d0 = ConstVec3Map(a.arc->tilt[0]).dot(b.other_axes);
    const Real d1 = ConstVec3Map(a.arc->tilt[1]).dot(b.other_axes);
    const Real plus = std::max(std::max(c0, -c1), std::max(d0, -d1));
    const Real minus = std::max(std::max(-c0, c1), std::max(-d0, d1));
    const Real height = std::min(plus, minus);
    if (height >= epsilon_ && height > tolerance_) return;
    const Vec3 m = u.cross(v);
    const Real sine2 = m.squaredNorm();
    if (height > tolerance_ && height * height >= epsilon_ * epsilon_ * sine2) return;
    const Real sign = plus <= minus ? 1.0_r : -1.0_r;
    const Vec3 w = a.origin_w - b.origin_w;
    const Real g = sign * m.dot(w);
    const Real least = best_ - epsilon_;
    const Real square = least * least * sine2;
    if (least >= 0 ? (g <= 0 || g * g <= square) : (g < 0 && g * g >= square)) return;
    take_pair(a, b, {c0, c1, d0, d1, height, std::sqrt(sine2), sign}, m, w, collect);
  }

  struct PairHeights {
    Real c0, c1;  ///< of B's apexes, times the sine
    Real d0, d1;  ///< of A's
    Real height;  ///< the violation, times the sine
    Real sine, sign;
  };

  void take_pair(const ActiveEdge& a, const ActiveEdge& b, const PairHeights& h, const Vec3& m,
                 const Vec3& w, bool collect) noexcept {
    if (h.sine < kParallelSine) return;
    const bool fits = h.height <= tolerance_;
    Vec3 n = (h.sign / h.sine) * m;
    if (fits && h.sine < kLerpSine) {
      const Vec3 between =
          h.sign * (ConstVec3Map(b.arc->tilt[0]) * h.c1 - ConstVec3Map(b.arc->tilt[1]) * h.c0);
      const Real length2 = between.squaredNorm();
      if (length2 > 0) n = between / std::sqrt(length2);
    }
    const Real f = n.dot(w);
    NearNode node;
    node.type = ContactType::kC;
    node.i = a.edge;
    node.j = b.edge;
    node.node = numbers_.type_c(a.edge, b.edge);
    node.normal_w = n;
    node.f_m = f;
    node.violation_m = h.height / h.sine;
    if (fits) count_pair(node, h);
    if (!collect || h.sine < kMinEdgeSine) return;
    if (h.height > 0) node.violation_m = std::max(node.violation_m, rise(node, h, *a.arc, *b.arc));
    if (f - std::max(node.violation_m, Real{0}) > best_ - epsilon_) collect_edge_pair(node);
  }

  /// Largest height that one of the pieces rises over the plane of an edge pair, where its apex
  /// does not tell; else a height that the apexes have.
  [[nodiscard]] Real rise(const NearNode& node, const PairHeights& h, const EdgeArc& arc_a,
                          const EdgeArc& arc_b) noexcept {
    // An apex tells only while n has left the arc at its side by less than a right angle: past an
    // edge that is nearly flat, or round to the back of a sharp one, n points into the piece.
    const auto told = [&h](const EdgeArc& arc, Real h0, Real h1, const Vec3& outward) {
      const bool up0 = h.sign * h0 > 0, up1 = h.sign * h1 < 0;
      const auto tells = [&](int k) {
        return arc.apex_rules[k] != 0 && ConstVec3Map(arc.tilt[k]).dot(outward) > 0;
      };
      return !(up0 && up1) && (!up0 || tells(0)) && (!up1 || tells(1));
    };
    const Vec3& n = node.normal_w;
    Real height = 0;
    if (!told(arc_a, h.d0, h.d1, -(pose_.r_wa.transpose() * n))) {
      const std::uint32_t a0 = a_.edges[node.i].vertex[0];
      const std::uint32_t support = lowest_vertex_a(pose_, n, a0);
      height = n.dot(pose_.vertex_a(a0) - pose_.vertex_a(support));
      result_.support_pairs += 1;
    }
    if (!told(arc_b, h.c0, h.c1, n)) {
      const std::uint32_t b0 = b_.edges[node.j].vertex[0];
      const std::uint32_t support = highest_vertex_b(pose_, n, b0);
      height = std::max(height, n.dot(pose_.vertex_b(support) - pose_.vertex_b(b0)));
      result_.support_pairs += 1;
    }
    return height;
  }

  /// The value of an applicable pair: f itself where the heights leave no doubt, for then the edges
  /// are the supports; else the gap along n, which is a lower bound whatever n is.
  void count_pair(const NearNode& node, const PairHeights& h) noexcept {
    if (node.f_m <= best_pair_value_ || node.f_m <= best_ - tolerance_) return;
    SupportPair support{a_.edges[node.i].vertex[0], b_.edges[node.j].vertex[0]};
    Real value = node.f_m;
    if (h.height > -tolerance_ || h.sine < kWellConditionedSine) {
      result_.support_pairs += 1;
      support = support_pair(pose_, node.normal_w, support);
      value = std::min(value, gap_along(pose_, node.normal_w, support));
    }
    if (value <= best_pair_value_) return;
    best_pair_value_ = value;
    best_pair_ = node;
    best_pair_support_ = support;
    best_ = std::max(best_, value);
  }

  void collect_edge_pair(const NearNode& node) noexcept {
    if (near_.size() < near_end_ && near_.push(node)) return;
    if (best_ > compacted_at_) {  // those that have fallen behind make room
      compacted_at_ = best_;
      std::uint32_t kept = near_begin_;
      for (std::uint32_t k = near_begin_; k < near_.size(); ++k) {
        if (near_[k].f_m - std::max(near_[k].violation_m, Real{0}) > best_ - epsilon_) {
          near_[kept++] = near_[k];
        }
      }
      near_.truncate(kept);
      if (near_.size() < near_end_ && near_.push(node)) return;
    }
    result_.flags |= kNearSetCut;
  }

  // --- Result ----------------------------------------------------------------------------------

  [[nodiscard]] bool is_near(Real f, Real violation) const noexcept {
    return std::abs(f - best_) + std::max(violation, Real{0}) < epsilon_;
  }

  /// Among ties a face: its normal is exact.
  void choose_best() noexcept {
    result_.d_near_m = best_;
    const Real best_face = std::max(best_gap_a_, best_gap_b_);
    bounds_.best_is_edges = best_pair_value_ > best_face + tolerance_;
    if (bounds_.best_is_edges) {
      bounds_.best_edge_a = best_pair_.i;
      bounds_.best_edge_b = best_pair_.j;
      result_.best = best_pair_;
      result_.support = best_pair_support_;
      return;
    }
    NearNode& best = result_.best;
    bounds_.best_is_of_a = !(best_gap_b_ > best_gap_a_ + tolerance_);
    if (!bounds_.best_is_of_a) {
      const std::uint32_t f = bounds_.best_face_b;
      const std::uint32_t v = bounds_.b.face_support[f];
      best.type = ContactType::kB;
      best.i = static_cast<std::uint16_t>(v);
      best.j = static_cast<std::uint16_t>(f);
      best.node = numbers_.type_b(v, f);
      best.normal_w = b_.face_normal(f);
      best.f_m = best_gap_b_;
      result_.support = {v, b_.face_vertices(f)[0]};
    } else {
      const std::uint32_t f = bounds_.best_face_a;
      const std::uint32_t v = bounds_.a.face_support[f];
      best.type = ContactType::kA;
      best.i = static_cast<std::uint16_t>(f);
      best.j = static_cast<std::uint16_t>(v);
      best.node = numbers_.type_a(f, v);
      best.normal_w = -pose_.normal_a(f);
      best.f_m = best_gap_a_;
      result_.support = {a_.face_vertices(f)[0], v};
    }
  }

  /// D_near is known now: the candidates that are not near leave.
  void keep_near_edge_pairs() noexcept {
    std::uint32_t kept = near_begin_;
    for (std::uint32_t k = near_begin_; k < near_.size(); ++k) {
      if (!is_near(near_[k].f_m, near_[k].violation_m)) continue;
      if (kept != k) near_[kept] = near_[k];
      ++kept;
    }
    near_.truncate(kept);
  }

  void collect_near_faces() noexcept {
    const Real least_a = best_ - relax_a_, least_b = best_ - relax_b_;
    for (const TouchedFace& touched : scratch_.touched) {
      if (touched.gap_m < (touched.of_a ? least_a : least_b)) continue;
      if (touched.of_a) {
        walk_face_a(touched);
      } else {
        walk_face_b(touched);
      }
    }
  }

  /// Near nodes (F_A, v): walks the graph over the neighbors that keep the face.
  void walk_face_a(const TouchedFace& touched) noexcept {
    const std::uint32_t f = touched.face;
    const Vec3 n = -pose_.normal_a(f);
    const Real offset = a_.face_offset(f);
    walk(
        ContactType::kA, touched,
        [&](std::uint32_t v) { return n.dot(pose_.y_w - pose_.vertex_b(v)) - offset; }, n);
  }
  /// Near nodes (v, F_B).
  void walk_face_b(const TouchedFace& touched) noexcept {
    const std::uint32_t f = touched.face;
    const Vec3 n = b_.face_normal(f);
    const Real offset = b_.face_offset(f);
    walk(
        ContactType::kB, touched,
        [&](std::uint32_t v) { return n.dot(pose_.y_w + pose_.vertex_a(v)) - offset; }, n);
  }

  /// Visits the vertices with f < D_near + epsilon from the support vertex on, over the arcs of the
  /// graph that keep the face. Each vertex comes once.
  template <typename ValueAt>
  void walk(ContactType type, const TouchedFace& touched, const ValueAt& value_at,
            const Vec3& n) noexcept {
    const std::uint32_t face = touched.face;
    const Real limit = std::min(best_ + epsilon_, touched.gap_m + kMaxRise * epsilon_);
    if (touched.gap_m >= limit) return;
    std::uint32_t count = 0;
    const auto enter = [&](std::uint32_t v) {
      std::uint64_t& word = scratch_.marks[v / 64];
      const std::uint64_t bit = std::uint64_t{1} << (v % 64);
      if ((word & bit) != 0) return;
      word |= bit;
      scratch_.queue[count++] = static_cast<std::uint16_t>(v);
    };
    enter((type == ContactType::kA ? bounds_.a : bounds_.b).face_support[face]);
    for (std::uint32_t k = 0; k < count; ++k) {
      const std::uint32_t v = scratch_.queue[k];
      const Real f = value_at(v);
      Real lowest = std::numeric_limits<Real>::max();  // of the neighbours
      const bool a_face = type == ContactType::kA;
      for_each_face_neighbor(*pose_.pair, type, a_face ? face : v, a_face ? v : face,
                             [&](std::uint32_t other) {
                               const Real value = value_at(other);
                               lowest = std::min(lowest, value);
                               if (value < limit) enter(other);
                             });
      if (is_near(f, f - lowest)) push_face_node(type, touched, v, n, f, f - lowest);
    }
    for (std::uint32_t k = 0; k < count; ++k) scratch_.marks[scratch_.queue[k] / 64] = 0;
  }

  void push_face_node(ContactType type, const TouchedFace& touched, std::uint32_t vertex,
                      const Vec3& n, Real f, Real violation) noexcept {
    const std::uint32_t face = touched.face;
    NearNode node;
    node.type = type;
    const bool a_face = type == ContactType::kA;
    node.i = static_cast<std::uint16_t>(a_face ? face : vertex);
    node.j = static_cast<std::uint16_t>(a_face ? vertex : face);
    node.node = a_face ? numbers_.type_a(face, vertex) : numbers_.type_b(vertex, face);
    node.normal_w = n;
    node.f_m = f;
    node.violation_m = violation;
    node.rise_m = f - touched.gap_m;
    if (near_.size() >= near_end_ || !near_.push(node)) result_.flags |= kNearSetCut;
  }

  [[nodiscard]] std::uint32_t feature_count() const noexcept {
    return numbers_.nfa + numbers_.nea + numbers_.nfb + numbers_.neb;
  }

  const PairPose& pose_;
  const PieceView& a_;
  const PieceView& b_;
  NodeNumbering numbers_;
  Real epsilon_;
  Real tolerance_;          ///< of heights: below it a sign may be rounding [m]
  Real relax_edges_;        ///< how far below D_near the bound of an edge of a near node can be [m]
  Real relax_a_, relax_b_;  ///< the same of the faces of A and B [m]
  FeatureBounds& bounds_;
  NearScratch& scratch_;
  BoundedList<NearNode>& near_;
  std::uint32_t near_begin_, near_end_;
  std::uint32_t seed_a_ = UINT32_MAX, seed_b_ = UINT32_MAX;  ///< faces evaluated as seeds
  Real best_ = kLowest;                                      ///< L
  Real best_gap_a_ = kLowest, best_gap_b_ = kLowest;
  Real best_pair_value_ = kLowest;
  NearNode best_pair_;
  SupportPair best_pair_support_;
  Real compacted_at_ = kLowest;
  NearResult result_;
};

}  // namespace

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
                         NearScratch& scratch, BoundedList<NearNode>& near) noexcept {
  return NearSearch(pose, epsilon_m, bounds, scratch, near).run();
}

}  // namespace haptic
