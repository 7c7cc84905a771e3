// SPDX-License-Identifier: Apache-2.0
// Edges of the near set search: bounds over their arcs, and the pairs of those that matter.
#include "rt_core/tracking/near_search.hpp"

namespace haptic {
namespace {

/// Edges closer to parallel than this carry no type-C value: their C-face is a strip narrower than
/// the rounding of its neighbours (METHOD section 11).
constexpr Real kParallelSine = HAPTIC_REAL_IS_FLOAT ? 1.0e-5_r : 1.0e-12_r;
/// Below this sine an applicable normal is taken from the two face normals of B's edge, between
/// which it lies, instead of the cross product, which has lost its digits.
constexpr Real kLerpSine = HAPTIC_REAL_IS_FLOAT ? 1.0e-2_r : 1.0e-6_r;

/// Directions cos(t) mid + sin(t) side, |t| at most the angle of cosine and sine.
struct Arc {
  Vec3 mid, side;
  Real cosine, sine;
};

/// Beyond the normals of both faces of a facet by so much [rad], that rounding of a direction
/// leaves nothing out.
constexpr Real kBeyondFacet = 1.0e-3_r;

/// The arc of edge `e` as EdgeArc has it. Of a facet nothing is stored: between its two normals,
/// and the whole circle where nodes count that apply within `epsilon_m`.
Arc arc_of(const PieceView& piece, std::uint32_t e, Real epsilon_m) noexcept {
  if (piece.is_facet()) {
    const bool whole = epsilon_m > 0;
    return {piece.side_normal(e), piece.face_normal(piece.edges[e].face[1]),
            whole ? -1.0_r : -kBeyondFacet, whole ? 0.0_r : 1 - kBeyondFacet * kBeyondFacet / 2};
  }
  const EdgeArc& arc = piece.arcs[e];
  return {ConstVec3Map(arc.mid), ConstVec3Map(arc.side), arc.cosine, arc.sine};
}

/// Largest n.w over the unit directions n of an arc. Cost: two dots and a root.
Real arc_peak(const Arc& arc, const Vec3& w) noexcept {
  const Real p = arc.mid.dot(w);
  const Real q = std::abs(arc.side.dot(w));
  if (p * arc.sine - q * arc.cosine >= 0) return std::sqrt(p * p + q * q);  // the peak is inside
  return p * arc.cosine + q * arc.sine;
}

/// Largest min(n.v, n.w) over the unit directions n of an arc: attained at an end, at a peak of one
/// of the two, or where they cross. Never above the smaller of both peaks. Cost: three roots.
Real arc_peak_of_both(const Arc& arc, const Vec3& v, const Vec3& w) noexcept {
  const Real vp = arc.mid.dot(v), vq = arc.side.dot(v);
  const Real wp = arc.mid.dot(w), wq = arc.side.dot(w);
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

}  // namespace

void NearSearch::seed_edge_pair() noexcept {
  test_pair(active_edge_a(start_.edge_a), active_edge_b(start_.edge_b), false);
}

void NearSearch::search_edges() noexcept {
  PieceKeys& b = bounds_.b;
  list(b.edges, best_.value - slack_.edges_m - b.odometer);
  for (std::uint32_t k = 0; k < b.edges.listed; ++k) {
    const std::uint32_t e = b.edges.shortlist[k];
    if (!matters(b, e) || !in_scope(marks_.features.edge_b(e))) continue;
    if (old(b, e)) store_edge(b, e, bound_edge_b(e));
    if (matters(b, e)) static_cast<void>(scratch_.active_b.push(active_edge_b(e)));
  }
  if (scratch_.active_b.empty()) return;  // no edge of B, no edge pair
  PieceKeys& a = bounds_.a;
  list(a.edges, best_.value - slack_.edges_m - a.odometer);
  for (std::uint32_t k = 0; k < a.edges.listed; ++k) {
    const std::uint32_t e = a.edges.shortlist[k];
    if (!matters(a, e) || !in_scope(marks_.features.edge_a(e))) continue;
    if (old(a, e)) store_edge(a, e, bound_edge_a(e));
    if (matters(a, e)) static_cast<void>(scratch_.active_a.push(active_edge_a(e)));
  }
}

void NearSearch::store_edge(PieceKeys& keys, std::uint32_t e, Real bound) noexcept {
  result_.feature_evaluations += 1;
  keys.edge_stamp[e] = keys.odometer;
  store_key(keys, keys.edges.key[e], bound);
}

Real NearSearch::bound_edge_b(std::uint32_t e) const noexcept {
  const EdgeRecord& edge = b_.edges[e];
  const Vec3 from = pose_.y_w - pose_.vertex_b(edge.vertex[0]);
  const std::uint32_t v0 = bounds_.b.face_support[edge.face[0]];
  const std::uint32_t v1 = bounds_.b.face_support[edge.face[1]];
  const Arc arc = arc_of(b_, e, epsilon_);
  const Real bound = arc_peak(arc, from + pose_.vertex_a(v0));
  if (v0 == v1 || bound < best_.value - slack_.edges_m) return bound;
  return arc_peak_of_both(arc, from + pose_.vertex_a(v0), from + pose_.vertex_a(v1));
}

Real NearSearch::bound_edge_a(std::uint32_t e) const noexcept {
  const EdgeRecord& edge = a_.edges[e];
  const Vec3 a0 = a_.vertex(edge.vertex[0]);
  const std::uint32_t v0 = bounds_.a.face_support[edge.face[0]];
  const std::uint32_t v1 = bounds_.a.face_support[edge.face[1]];
  const auto from = [&](std::uint32_t v) -> Vec3 {
    return pose_.r_wa.transpose() * (pose_.vertex_b(v) - pose_.y_w) - a0;
  };
  const Vec3 w0 = from(v0);
  const Arc arc = arc_of(a_, e, epsilon_);
  const Real bound = arc_peak(arc, w0);
  if (v0 == v1 || bound < best_.value - slack_.edges_m) return bound;
  return arc_peak_of_both(arc, w0, from(v1));
}

ActiveEdge NearSearch::active_edge_a(std::uint32_t e) const noexcept {
  ActiveEdge active;
  active.direction_w = pose_.direction_a(e);
  active.origin_w = pose_.y_w + pose_.vertex_a(a_.edges[e].vertex[0]);
  active.arc = a_.is_facet() ? nullptr : &a_.arcs[e];
  active.edge = static_cast<std::uint16_t>(e);
  return active;
}

ActiveEdge NearSearch::active_edge_b(std::uint32_t e) const noexcept {
  ActiveEdge active;
  active.direction_w = ConstVec3Map(b_.edge_directions[e].unit);
  active.other_axes = pose_.r_wa.transpose() * active.direction_w;
  active.origin_w = pose_.vertex_b(b_.edges[e].vertex[0]);
  active.arc = b_.is_facet() ? nullptr : &b_.arcs[e];
  active.edge = static_cast<std::uint16_t>(e);
  return active;
}

void NearSearch::test_edge_pairs() noexcept {
  const std::uint32_t capacity = pose_.pair->record.edge_pair_capacity;
  for (const ActiveEdge& b : scratch_.active_b) {
    if (marks_.given()) {
      if (!test_marked(b, capacity)) return;
      continue;
    }
    if (result_.edge_pairs + scratch_.active_a.size() > capacity) {
      result_.flags |= kNearEdgePairsCut;
      return;
    }
    result_.edge_pairs += scratch_.active_a.size();
    for (const ActiveEdge& a : scratch_.active_a) test_pair(a, b, collects_);
  }
}

bool NearSearch::test_marked(const ActiveEdge& b, std::uint32_t capacity) noexcept {
  for (const ActiveEdge& a : scratch_.active_a) {
    const std::uint32_t node = numbers_.type_c(a.edge, b.edge);
    if (!marks_.node(scope_, node)) continue;
    if (result_.edge_pairs == capacity) {
      result_.flags |= kNearEdgePairsCut;
      return false;
    }
    result_.edge_pairs += 1;
    test_pair(a, b, collects_ && marks_.node(NodeScope::kLive, node));
  }
  return true;
}

void NearSearch::test_pair(const ActiveEdge& a, const ActiveEdge& b, bool collect) noexcept {
  const Vec3& u = a.direction_w;
  const Vec3& v = b.direction_w;
  const Real c0 = b_.tilt(b.edge, 0).dot(u), c1 = b_.tilt(b.edge, 1).dot(u);
  const Real least_c = std::min(std::max(c0, -c1), std::max(-c0, c1));
  if (least_c >= epsilon_ && least_c > slack_.heights_m) return;  // the sine is at most 1
  const Real d0 = a_.tilt(a.edge, 0).dot(b.other_axes);
  const Real d1 = a_.tilt(a.edge, 1).dot(b.other_axes);
  const Real plus = std::max(std::max(c0, -c1), std::max(d0, -d1));
  const Real minus = std::max(std::max(-c0, c1), std::max(-d0, d1));
  const Real height = std::min(plus, minus);
  if (height >= epsilon_ && height > slack_.heights_m) return;
  const Vec3 m = u.cross(v);
  const Real sine2 = m.squaredNorm();
  if (height > slack_.heights_m && height * height >= epsilon_ * epsilon_ * sine2) return;
  const Real sign = plus <= minus ? 1.0_r : -1.0_r;
  const Vec3 w = a.origin_w - b.origin_w;
  const Real g = sign * m.dot(w);
  const Real least = best_.value - epsilon_;
  const Real square = least * least * sine2;
  if (least >= 0 ? (g <= 0 || g * g <= square) : (g < 0 && g * g >= square)) return;
  take_pair(a, b, {c0, c1, d0, d1, height, std::sqrt(sine2), sign, collect}, m, w);
}

void NearSearch::take_pair(const ActiveEdge& a, const ActiveEdge& b, const PairHeights& h,
                           const Vec3& m, const Vec3& w) noexcept {
  if (h.sine < kParallelSine) return;
  const bool fits = h.height <= slack_.heights_m;
  Vec3 n = (h.sign / h.sine) * m;
  if (fits && h.sine < kLerpSine) {
    const Vec3 between = h.sign * (b_.tilt(b.edge, 0) * h.c1 - b_.tilt(b.edge, 1) * h.c0);
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
  if (!h.collect || h.sine < kMinEdgeSine) return;
  if (h.height > 0) node.violation_m = std::max(node.violation_m, rise(node, h, a.arc, b.arc));
  if (f - std::max(node.violation_m, Real{0}) > best_.value - epsilon_) collect_edge_pair(node);
}

Real NearSearch::rise(const NearNode& node, const PairHeights& h, const EdgeArc* arc_a,
                      const EdgeArc* arc_b) noexcept {
  // An apex tells only while n has left the arc at its side by less than a right angle: past an
  // edge that is nearly flat, or round to the back of a sharp one, n points into the piece.
  const auto told = [&h](const EdgeArc* arc, Real h0, Real h1, const Vec3& outward) {
    const bool up0 = h.sign * h0 > 0, up1 = h.sign * h1 < 0;
    const auto tells = [&](int k) {
      return arc != nullptr && arc->apex_rules[k] != 0 &&
             ConstVec3Map(arc->tilt[k]).dot(outward) > 0;
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

void NearSearch::count_pair(const NearNode& node, const PairHeights& h) noexcept {
  if (node.f_m <= best_.pair_value || node.f_m <= best_.value - slack_.heights_m) return;
  SupportPair support{a_.edges[node.i].vertex[0], b_.edges[node.j].vertex[0]};
  Real value = node.f_m;
  if (h.height > -slack_.heights_m || h.sine < kWellConditionedSine) {
    if (!collects_ && result_.support_pairs == kMaxNearestSupports) {
      result_.flags |= kNearSupportsCut;
      return;
    }
    result_.support_pairs += 1;
    support = support_pair(pose_, node.normal_w, support);
    value = std::min(value, gap_along(pose_, node.normal_w, support));
    if (is_live() && !ties(node.f_m, value)) return;  // another node's, which may be hidden
  }
  if (value <= best_.pair_value) return;
  best_.pair_value = value;
  best_.pair = node;
  best_.pair_support = support;
  best_.value = std::max(best_.value, value);
}

void NearSearch::collect_edge_pair(const NearNode& node) noexcept {
  if (near_.size() < near_end_ && near_.push(node)) return;
  if (best_.value > compacted_at_) {  // those that have fallen behind make room
    compacted_at_ = best_.value;
    std::uint32_t kept = near_begin_;
    for (std::uint32_t k = near_begin_; k < near_.size(); ++k) {
      if (near_[k].f_m - std::max(near_[k].violation_m, Real{0}) > best_.value - epsilon_) {
        near_[kept++] = near_[k];
      }
    }
    near_.truncate(kept);
    if (near_.size() < near_end_ && near_.push(node)) return;
  }
  result_.flags |= kNearSetCut;
}

void NearSearch::keep_near_edge_pairs() noexcept {
  std::uint32_t kept = near_begin_;
  for (std::uint32_t k = near_begin_; k < near_.size(); ++k) {
    if (!is_near(near_[k].f_m, near_[k].violation_m)) continue;
    if (kept != k) near_[kept] = near_[k];
    ++kept;
  }
  near_.truncate(kept);
}

}  // namespace haptic
