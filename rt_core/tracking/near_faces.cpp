// SPDX-License-Identifier: Apache-2.0
// Faces of the near set search: which are evaluated, and the near nodes on them.
#include "rt_core/tracking/near_search.hpp"

namespace haptic {

void NearSearch::seed_face() noexcept {
  if (start_.is_of_a) {
    seed_a_ = start_.face_a;
    evaluate_face_a(start_.face_a);
  } else {
    seed_b_ = start_.face_b;
    evaluate_face_b(start_.face_b);
  }
}

void NearSearch::search_faces() noexcept {
  list(bounds_.b.faces, best_.value - slack_.faces_b_m - bounds_.b.odometer);
  for (std::uint32_t k = 0; k < bounds_.b.faces.listed; ++k) {
    const std::uint32_t f = bounds_.b.faces.shortlist[k];
    if (f == seed_b_ || !in_scope(marks_.features.face_b(f))) continue;
    if (bounds_.b.faces.key[f] + bounds_.b.odometer >= best_.value - slack_.faces_b_m)
      evaluate_face_b(f);
  }
  list(bounds_.a.faces, best_.value - slack_.faces_a_m - bounds_.a.odometer);
  for (std::uint32_t k = 0; k < bounds_.a.faces.listed; ++k) {
    const std::uint32_t f = bounds_.a.faces.shortlist[k];
    if (f == seed_a_ || !in_scope(marks_.features.face_a(f))) continue;
    if (bounds_.a.faces.key[f] + bounds_.a.odometer >= best_.value - slack_.faces_a_m)
      evaluate_face_a(f);
  }
}

std::uint32_t NearSearch::support_start(const PieceView& piece, const PieceKeys& keys,
                                        std::uint32_t f) noexcept {
  if (keys.faces.key[f] < kStaleKey) return keys.face_support[f];
  for (const std::uint16_t e : piece.face_edges(f)) {
    const EdgeRecord& edge = piece.edges[e];
    const std::uint32_t other = edge.face[0] == f ? edge.face[1] : edge.face[0];
    if (keys.faces.key[other] < kStaleKey) return keys.face_support[other];
  }
  return 0;
}

void NearSearch::evaluate_face_a(std::uint32_t f) noexcept {
  const Vec3 n = -pose_.normal_a(f);
  const std::uint32_t v = highest_vertex_b(pose_, n, support_start(a_, bounds_.a, f));
  const Real gap = n.dot(pose_.y_w - pose_.vertex_b(v)) - a_.face_offset(f);
  take_face(bounds_.a, f, v, gap, true, n);
}

void NearSearch::evaluate_face_b(std::uint32_t f) noexcept {
  const Vec3 n = b_.face_normal(f);
  const std::uint32_t v = lowest_vertex_a(pose_, n, support_start(b_, bounds_.b, f));
  const Real gap = n.dot(pose_.y_w + pose_.vertex_a(v)) - b_.face_offset(f);
  take_face(bounds_.b, f, v, gap, false, n);
}

void NearSearch::take_face(PieceKeys& keys, std::uint32_t f, std::uint32_t support, Real gap,
                           bool of_a, const Vec3& n) noexcept {
  result_.feature_evaluations += 1;
  keys.face_support[f] = static_cast<std::uint16_t>(support);
  store_key(keys, keys.faces.key[f], gap);
  static_cast<void>(scratch_.touched.push({gap, static_cast<std::uint16_t>(f), of_a}));
  if (is_live() && !counts(of_a, f, support, n)) return;
  Real& best = of_a ? best_.gap_a : best_.gap_b;
  std::uint32_t& best_face = of_a ? best_.face_a : best_.face_b;
  if (gap > best || (gap == best && f < best_face)) {
    best = gap;
    best_face = f;
  }
  best_.value = std::max(best_.value, gap);
}

bool NearSearch::counts(bool of_a, std::uint32_t f, std::uint32_t support, const Vec3& n) noexcept {
  const auto live = [&](std::uint32_t v) {
    return marks_.node(scope_, of_a ? numbers_.type_a(f, v) : numbers_.type_b(v, f));
  };
  if (live(support)) return true;
  // The support vertices of a face that lies on another are a face or an edge of it.
  const PieceView& piece = of_a ? b_ : a_;
  const auto height = [&](std::uint32_t v) {
    return of_a ? n.dot(pose_.vertex_b(v)) : -n.dot(pose_.vertex_a(v));
  };
  const Real least = height(support) - (of_a ? slack_.tie_b_m : slack_.tie_a_m);
  for (const std::uint16_t e : piece.edges_at(support)) {
    if (height(piece.other_end(e, support)) < least) continue;
    for (const std::uint16_t side : piece.edges[e].face) {
      for (const std::uint16_t v : piece.face_vertices(side)) {
        if (height(v) >= least && live(v)) return true;
      }
    }
  }
  return false;
}

template <typename ValueAt>
void NearSearch::walk(ContactType type, const TouchedFace& touched, const ValueAt& value_at,
                      const Vec3& n, Real below) noexcept {
  const std::uint32_t face = touched.face;
  const Real limit = std::min(below, touched.gap_m + kMaxRise * epsilon_);
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

void NearSearch::collect_near_faces() noexcept {
  const Real least_a = best_.value - slack_.faces_a_m, least_b = best_.value - slack_.faces_b_m;
  for (const TouchedFace& touched : scratch_.touched) {
    if (touched.gap_m < (touched.of_a ? least_a : least_b)) continue;
    const FeatureNumbering& of = marks_.features;
    if (!marks_.feature(NodeScope::kLive,
                        touched.of_a ? of.face_a(touched.face) : of.face_b(touched.face))) {
      continue;
    }
    if (touched.of_a) {
      walk_face_a(touched, best_.value + epsilon_);
    } else {
      walk_face_b(touched, best_.value + epsilon_);
    }
  }
}

void NearSearch::walk_face_a(const TouchedFace& touched, Real below) noexcept {
  const std::uint32_t f = touched.face;
  const Vec3 n = -pose_.normal_a(f);
  const Real offset = a_.face_offset(f);
  walk(
      ContactType::kA, touched,
      [&](std::uint32_t v) { return n.dot(pose_.y_w - pose_.vertex_b(v)) - offset; }, n, below);
}

void NearSearch::walk_face_b(const TouchedFace& touched, Real below) noexcept {
  const std::uint32_t f = touched.face;
  const Vec3 n = b_.face_normal(f);
  const Real offset = b_.face_offset(f);
  walk(
      ContactType::kB, touched,
      [&](std::uint32_t v) { return n.dot(pose_.y_w + pose_.vertex_a(v)) - offset; }, n, below);
}

void NearSearch::push_face_node(ContactType type, const TouchedFace& touched, std::uint32_t vertex,
                                const Vec3& n, Real f, Real violation) noexcept {
  const std::uint32_t face = touched.face;
  NearNode node;
  node.type = type;
  const bool a_face = type == ContactType::kA;
  node.i = static_cast<std::uint16_t>(a_face ? face : vertex);
  node.j = static_cast<std::uint16_t>(a_face ? vertex : face);
  node.node = a_face ? numbers_.type_a(face, vertex) : numbers_.type_b(vertex, face);
  if (!marks_.node(NodeScope::kLive, node.node)) return;
  node.normal_w = n;
  node.f_m = f;
  node.violation_m = violation;
  if (near_.size() >= near_end_ || !near_.push(node)) result_.flags |= kNearSetCut;
}

}  // namespace haptic
