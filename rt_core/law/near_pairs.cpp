// SPDX-License-Identifier: Apache-2.0
#include "rt_core/law/near_pairs.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "rt_core/contact/pair_gate.hpp"

namespace haptic {
namespace {

Real sphere_distance(const PieceSphere& a_w, const PieceSphere& b_w) noexcept {
  const Real between = std::sqrt((a_w.centre - b_w.centre).squaredNorm());
  const Real size = std::sqrt(a_w.centre.squaredNorm()) + std::sqrt(b_w.centre.squaredNorm()) +
                    a_w.radius_m + b_w.radius_m;
  return between - (a_w.radius_m + b_w.radius_m) - 32 * kRealEpsilon * size;
}

}  // namespace

void NearPairs::place(Arena& arena, const SceneView& scene, std::uint32_t slots) noexcept {
  const std::uint32_t of_a = scene.bodies()[0].piece_count;
  const auto pieces = static_cast<std::uint32_t>(scene.pieces().size());
  const bool boxed = scene.has_facets();
  tree_a_.place(arena, of_a, boxed);
  tree_b_.place(arena, pieces - of_a, boxed);
  spheres_ = arena.take<PieceSphere>(pieces);
  if (boxed) boxes_ = arena.take<PieceBox>(pieces);
  pairs_ = arena.take<NearPair>(slots);
  listed_ = BoundedList<std::uint32_t>(arena.take<std::uint32_t>(slots));
  free_ = BoundedList<std::uint32_t>(arena.take<std::uint32_t>(slots));
  changed_ = BoundedList<std::uint32_t>(arena.take<std::uint32_t>(slots));
  table_ = arena.take<std::uint32_t>(std::bit_ceil(4 * std::size_t{slots}));
  at_ = arena.take<Place>(1);
  waiting_ = arena.take<NodePair>(kMostWaiting);
  found_ = BoundedList<Found>(arena.take<Found>(slots));
}

void NearPairs::read_scene(const SceneView& scene) noexcept {
  scene_ = &scene;
  const std::uint32_t of_a = scene.bodies()[0].piece_count;
  for (std::uint32_t i = 0; i < spheres_.size(); ++i) {
    const PieceRecord& piece = scene.pieces()[i];
    PieceSphere& sphere = spheres_[i];
    sphere.centre = piece_centre(piece);
    sphere.radius_m = static_cast<Real>(piece.radius_m) * (1 + 4 * kRealEpsilon);
    Vec3 reference = Vec3::Zero();
    if (i >= of_a) {
      const BodyRecord& body = scene.bodies()[piece.body];
      for (int k = 0; k < 3; ++k) reference[k] = static_cast<Real>(body.reference_m[k]);
      sphere.centre += reference;
    }
    if (!kSceneTraits.free_orientation || boxes_.empty()) continue;
    const PieceView view = scene.piece(i);
    boxes_[i] = {view.vertex(0), view.vertex(0)};
    for (std::uint32_t v = 1; v < view.vertex_count; ++v)
      boxes_[i].take({view.vertex(v), view.vertex(v)});
    boxes_[i].low += reference;
    boxes_[i].high += reference;
  }
  const std::size_t boxed_a = boxes_.empty() ? 0 : of_a;
  tree_a_.build(spheres_.first(of_a), boxes_.first(boxed_a));
  tree_b_.build(spheres_.subspan(of_a), boxes_.subspan(boxed_a));
  reset();
}

void NearPairs::reset() noexcept {
  listed_.clear();
  changed_.clear();
  free_.clear();
  for (auto slot = static_cast<std::uint32_t>(pairs_.size()); slot > 0; --slot) {
    pairs_[slot - 1] = {};
    static_cast<void>(free_.push(slot - 1));
  }
  list_ = 0;
  begun_ = false;
  clear_until_m_ = -std::numeric_limits<double>::max();
}

/// Where the table has a pair, or would have it.
std::uint32_t* NearPairs::entry_of(std::uint32_t pair) noexcept {
  const auto mask = static_cast<std::uint32_t>(table_.size() - 1);
  std::uint32_t at = (pair * 0x9e3779b9u) >> 7 & mask;
  while (table_[at] != 0 && pairs_[table_[at] - 1].pair != pair) at = (at + 1) & mask;
  return &table_[at];
}

void NearPairs::fill_table() noexcept {
  std::fill(table_.begin(), table_.end(), 0u);
  for (std::uint32_t slot = 0; slot < pairs_.size(); ++slot) {
    if (pairs_[slot].listed == 0) continue;
    *entry_of(pairs_[slot].pair) = slot + 1;
  }
}

/// A lower bound of the gap between the pieces of two nodes: between their spheres, and where
/// pieces are facets, whose spheres are mostly empty, between their boxes, along the axes of
/// either; as far as it takes to be above the range.
Real NearPairs::gap_of(std::uint32_t node_a, std::uint32_t node_b) const noexcept {
  const auto& [p, turn_abs] = at_[0];
  const PieceSphere& a = tree_a_.node(node_a).sphere;
  const PieceSphere& b = tree_b_.node(node_b).sphere;
  const PieceSphere a_w{p.r_wa * a.centre + p.x0_w, a.radius_m};
  Real gap = sphere_distance(a_w, b);
  if (!kSceneTraits.free_orientation || boxes_.empty() || gap > range_m_) return gap;
  const PieceBox &box_a = tree_a_.box(node_a), &box_b = tree_b_.box(node_b);
  const Vec3 half_a = box_a.half(), half_b = box_b.half();
  const Vec3 between_w = p.r_wa * box_a.middle() + p.x0_w - box_b.middle();
  const Real rounding = 64 * kRealEpsilon *
                        (p.x0_w.cwiseAbs().sum() + between_w.cwiseAbs().sum() +
                         b.centre.cwiseAbs().sum() + half_a.sum() + half_b.sum() + 2 * a.radius_m);
  const auto apart = [&](const Vec3& between, const Vec3& halves) {
    const Vec3 outside = (between.cwiseAbs() - halves).cwiseMax(Vec3::Zero());
    return std::sqrt(outside.squaredNorm()) - rounding;
  };
  gap = std::max(gap, apart(between_w, half_b + turn_abs * half_a));
  if (gap > range_m_) return gap;
  return std::max(gap,
                  apart(p.r_wa.transpose() * between_w, half_a + turn_abs.transpose() * half_b));
}

/// A better lower bound of the gap between two facets than `gap_m`: of the plane of each.
Real NearPairs::facet_gap(std::uint32_t piece_a, std::uint32_t piece_b, Real gap_m) const noexcept {
  if (!kSceneTraits.free_orientation || boxes_.empty()) return gap_m;
  const PieceView a = scene_->piece(piece_a), b = scene_->piece(piece_b);
  if (!a.is_facet() || !b.is_facet()) return gap_m;
  const GripPose& p = at_[0].p;
  Vec3 b_w = Vec3::Zero();
  for (int k = 0; k < 3; ++k)
    b_w[k] = static_cast<Real>(scene_->bodies()[b.record->body].reference_m[k]);
  const Vec3 between_w = p.x0_w - b_w;
  const Vec3 normal_b = b.plane_normal(0), normal_a_w = p.r_wa * a.plane_normal(0);
  const Vec3 normal_b_a = p.r_wa.transpose() * normal_b;
  const auto beyond = [](const PieceView& piece, const Vec3& normal, Real offset) {
    Real least = std::numeric_limits<Real>::max(), most = -least;
    for (std::uint32_t v = 0; v < piece.vertex_count; ++v) {
      const Real at = normal.dot(piece.vertex(v)) + offset;
      least = std::min(least, at);
      most = std::max(most, at);
    }
    return std::max(least, -most);
  };
  const Real of_b = beyond(a, normal_b_a, normal_b.dot(between_w) - b.plane_offset(0));
  const Real of_a = beyond(b, normal_a_w, -normal_a_w.dot(between_w) - a.plane_offset(0));
  const Real size = p.x0_w.cwiseAbs().sum() + b_w.cwiseAbs().sum() +
                    tree_a_.node(0).sphere.radius_m + tree_b_.node(0).sphere.radius_m +
                    tree_a_.node(0).sphere.centre.norm() + tree_b_.node(0).sphere.centre.norm();
  return std::max({gap_m, of_a - 64 * kRealEpsilon * size, of_b - 64 * kRealEpsilon * size});
}

void NearPairs::begin(const GripPose& p, double odometer_m, Real range_m) noexcept {
  begun_ = true;
  at_[0] = {p, p.r_wa.cwiseAbs()};
  odometer_m_ = odometer_m;
  range_m_ = range_m;
  left_m_ = std::numeric_limits<Real>::max();
  waiting_[0] = NodePair{};
  waiting_count_ = 1;
  visited_ = 0;
  found_.clear();
}

bool NearPairs::go_on(std::uint32_t most_visits) noexcept {
  const std::uint32_t of_a = scene_->bodies()[0].piece_count;
  for (std::uint32_t visits = 0; waiting_count_ > 0; ++visits) {
    if (visits == most_visits) return false;
    const NodePair next = waiting_[--waiting_count_];
    visited_ += 1;
    const PieceNode& a = tree_a_.node(next.a);
    const PieceNode& b = tree_b_.node(next.b);
    const Real gap = gap_of(next.a, next.b);
    if (gap > range_m_) {
      left_m_ = std::min(left_m_, gap);
    } else if (a.count == 1 && b.count == 1) {
      const std::uint32_t pair = scene_->find_pair(tree_a_.piece(a), of_a + tree_b_.piece(b));
      if (pair == kNoPair) continue;
      const Real closer = facet_gap(tree_a_.piece(a), of_a + tree_b_.piece(b), gap);
      if (closer > range_m_) {
        left_m_ = std::min(left_m_, closer);
      } else {
        take(pair, closer);
      }
    } else if (b.count == 1 || (a.count > 1 && a.sphere.radius_m > b.sphere.radius_m)) {
      waiting_[waiting_count_++] = {a.child + 1, next.b};
      waiting_[waiting_count_++] = {a.child, next.b};
    } else {
      waiting_[waiting_count_++] = {next.a, b.child + 1};
      waiting_[waiting_count_++] = {next.a, b.child};
    }
  }
  finish();
  return true;
}

/// Takes a pair into the list that is begun; where that is full, in place of the farthest.
void NearPairs::take(std::uint32_t pair, Real gap_m) noexcept {
  const auto is_nearer = [](const Found& l, const Found& r) {
    return l.gap_m < r.gap_m || (l.gap_m == r.gap_m && l.pair > r.pair);
  };
  if (found_.push({pair, gap_m})) {
    if (found_.size() == found_.capacity()) std::make_heap(found_.begin(), found_.end(), is_nearer);
    return;
  }
  const Real farthest_m = found_[0].gap_m;
  const bool has_farther = farthest_m > gap_m;
  left_m_ = std::min(left_m_, has_farther ? farthest_m : gap_m);
  range_m_ = std::min(range_m_, farthest_m);
  if (!has_farther) return;
  std::pop_heap(found_.begin(), found_.end(), is_nearer);
  found_[found_.size() - 1] = {pair, gap_m};
  std::push_heap(found_.begin(), found_.end(), is_nearer);
}

/// The list that was begun takes the place of the one before.
void NearPairs::finish() noexcept {
  begun_ = false;
  list_ += 1;
  for (NearPair& pair : pairs_) {
    pair.changed = false;
    if (pair.pinned) pair.listed = list_;
  }
  fill_table();
  std::uint32_t others = 0;  // pairs that have no slot yet come first
  for (const Found& found : found_) {
    const std::uint32_t known = *entry_of(found.pair);
    if (known == 0) {
      found_[others++] = found;
      continue;
    }
    pairs_[known - 1].gap_m = found.gap_m;
    pairs_[known - 1].listed = list_;
  }
  std::uint32_t cursor = 0;
  for (std::uint32_t k = 0; k < others; ++k) put(found_[k], cursor);
  listed_.clear();
  changed_.clear();
  for (std::uint32_t slot = 0; slot < pairs_.size(); ++slot) {
    NearPair& pair = pairs_[slot];
    pair.pinned = false;
    if (pair.listed == list_) {
      static_cast<void>(listed_.push(slot));
    } else if (pair.listed != 0) {
      pair.listed = 0;
      pair.changed = true;
      static_cast<void>(free_.push(slot));
    }
    if (pair.changed) static_cast<void>(changed_.push(slot));
  }
  clear_until_m_ = odometer_m_ + static_cast<double>(left_m_);
}

/// Puts a pair into a free slot, or that of a pair which is not in the list any more.
void NearPairs::put(const Found& found, std::uint32_t& cursor) noexcept {
  std::uint32_t slot = kNoPair;
  if (!free_.empty()) {
    slot = free_[free_.size() - 1];
    free_.truncate(free_.size() - 1);
  } else {
    while (cursor < pairs_.size() && pairs_[cursor].listed == list_) ++cursor;
    if (cursor < pairs_.size()) slot = cursor;
  }
  if (slot == kNoPair) {  // pairs that must stay have left no room
    left_m_ = std::min(left_m_, found.gap_m);
    return;
  }
  pairs_[slot] = {found.pair, found.gap_m, list_, true, false};
}

}  // namespace haptic
