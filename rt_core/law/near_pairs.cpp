// SPDX-License-Identifier: Apache-2.0
#include "rt_core/law/near_pairs.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "rt_core/contact/pair_gate.hpp"

namespace haptic {
namespace {

/// A node of each of the two trees.
struct NodePair {
  std::uint32_t a = 0, b = 0;
};

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
  entries_ = 0;
  for (std::uint32_t slot = 0; slot < pairs_.size(); ++slot) {
    if (pairs_[slot].listed == 0) continue;
    *entry_of(pairs_[slot].pair) = slot + 1;
    entries_ += 1;
  }
}

/// A lower bound of the gap between the pieces of two nodes: between their spheres, and where
/// pieces are facets, whose spheres are mostly empty, between their boxes, along the axes of
/// either. `turn_abs`: of p.r_wa, by element.
Real NearPairs::gap_of(const GripPose& p, const Mat3& turn_abs, std::uint32_t node_a,
                       std::uint32_t node_b) const noexcept {
  const PieceSphere& a = tree_a_.node(node_a).sphere;
  const PieceSphere& b = tree_b_.node(node_b).sphere;
  const PieceSphere a_w{p.r_wa * a.centre + p.x0_w, a.radius_m};
  const Real gap = sphere_distance(a_w, b);
  if (!kSceneTraits.free_orientation || boxes_.empty()) return gap;
  const PieceBox &box_a = tree_a_.box(node_a), &box_b = tree_b_.box(node_b);
  const Vec3 between_w = p.r_wa * box_a.middle() + p.x0_w - box_b.middle();
  const auto apart = [](const Vec3& between, const Vec3& half, const Vec3& half_turned) {
    const Vec3 outside = (between.cwiseAbs() - half - half_turned).cwiseMax(Vec3::Zero());
    return std::sqrt(outside.squaredNorm());
  };
  const Real boxed = std::max(
      apart(between_w, box_b.half(), turn_abs * box_a.half()),
      apart(p.r_wa.transpose() * between_w, box_a.half(), turn_abs.transpose() * box_b.half()));
  const Real size = std::sqrt(a_w.centre.squaredNorm()) + std::sqrt(b.centre.squaredNorm()) +
                    std::sqrt(p.x0_w.squaredNorm()) + a.radius_m + b.radius_m;
  return std::max(gap, boxed - 64 * kRealEpsilon * size);
}

void NearPairs::make(const GripPose& p, double odometer_m, Real range_m) noexcept {
  list_ += 1;
  for (NearPair& pair : pairs_) {
    pair.changed = false;
    if (!pair.pinned) continue;
    pair.listed = list_;
    pair.gap_m = -std::numeric_limits<Real>::max();
  }
  fill_table();
  listed_.clear();
  cursor_ = 0;
  const std::uint32_t of_a = scene_->bodies()[0].piece_count;
  left_m_ = std::numeric_limits<Real>::max();
  const Mat3 turn_abs = p.r_wa.cwiseAbs();
  std::array<NodePair, kMostWaiting> waiting;
  std::uint32_t count = 1;
  waiting[0] = NodePair{};
  visited_ = 0;
  while (count > 0) {
    const NodePair next = waiting[--count];
    visited_ += 1;
    const PieceNode& a = tree_a_.node(next.a);
    const PieceNode& b = tree_b_.node(next.b);
    const Real gap = gap_of(p, turn_abs, next.a, next.b);
    if (gap > range_m || visited_ > kMaxListVisits - kMostWaiting) {
      left_m_ = std::min(left_m_, gap);
    } else if (a.count == 1 && b.count == 1) {
      const std::uint32_t pair = scene_->find_pair(tree_a_.piece(a), of_a + tree_b_.piece(b));
      if (pair != kNoPair) take(pair, gap, range_m);
    } else if (b.count == 1 || (a.count > 1 && a.sphere.radius_m > b.sphere.radius_m)) {
      waiting[count++] = {a.child + 1, next.b};
      waiting[count++] = {a.child, next.b};
    } else {
      waiting[count++] = {next.a, b.child + 1};
      waiting[count++] = {next.a, b.child};
    }
  }
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
  clear_until_m_ = odometer_m + static_cast<double>(left_m_);
}

void NearPairs::take(std::uint32_t pair, Real gap_m, Real& range_m) noexcept {
  const std::uint32_t known = *entry_of(pair);
  if (known != 0) {
    NearPair& kept = pairs_[known - 1];
    if (!kept.pinned) kept.gap_m = gap_m;
    kept.listed = list_;
    return;
  }
  const std::uint32_t slot = slot_for(gap_m, range_m);
  if (slot == kNoPair) return;
  pairs_[slot] = {pair, gap_m, list_, true, false};
  if (entries_ >= table_.size() / 2) return fill_table();
  *entry_of(pair) = slot + 1;
  entries_ += 1;
}

/// A slot for a pair with this gap: a free one, that of a pair which this list does not have (yet),
/// or that of the farthest; none where there is none farther.
std::uint32_t NearPairs::slot_for(Real gap_m, Real& range_m) noexcept {
  if (!free_.empty()) {
    const std::uint32_t slot = free_[free_.size() - 1];
    free_.truncate(free_.size() - 1);
    return slot;
  }
  // What lies before the cursor is in this list, and stays.
  for (; cursor_ < pairs_.size(); ++cursor_) {
    if (pairs_[cursor_].listed != list_) return cursor_;
  }
  // The pool is full: a heap has the farthest pair, of equal ones the first, on its top.
  const auto is_nearer = [&](std::uint32_t l, std::uint32_t r) {
    const Real of_l = pairs_[l].gap_m, of_r = pairs_[r].gap_m;
    return of_l < of_r || (of_l == of_r && l > r);
  };
  if (listed_.empty()) {
    for (std::uint32_t slot = 0; slot < pairs_.size(); ++slot)
      static_cast<void>(listed_.push(slot));
    std::make_heap(listed_.begin(), listed_.end(), is_nearer);
  }
  const std::uint32_t farthest = listed_[0];
  const Real farthest_m = pairs_[farthest].gap_m;
  const bool has_farther = farthest_m > gap_m;
  left_m_ = std::min(left_m_, has_farther ? farthest_m : gap_m);
  range_m = std::min(range_m, farthest_m);
  if (!has_farther) return kNoPair;
  pairs_[farthest].gap_m = gap_m;
  std::pop_heap(listed_.begin(), listed_.end(), is_nearer);
  std::push_heap(listed_.begin(), listed_.end(), is_nearer);
  return farthest;
}

}  // namespace haptic
