// SPDX-License-Identifier: Apache-2.0
#include "rt_core/proxy/near_pairs.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "rt_core/contact/c_face_plane.hpp"
#include "rt_core/contact/piece_sphere.hpp"
#include "rt_core/proxy/edge_lines.hpp"

namespace haptic {
namespace {

/// Normals whose tips are no farther apart than this are one direction.
constexpr Real kSameDirection = 1.0e-3_r;
/// Gaps below this share of the range of a list count as that where groups are joined.
constexpr Real kLeastJoinRoom = 1.0e-3_r;
/// Facets nearer along their planes than this share of the range are asked for their nearest edges.
constexpr Real kLineShare = 1.0e-2_r;

/// Order of a heap with the farthest pair on its top.
constexpr auto is_nearer = [](const auto& l, const auto& r) {
  return l.rank_m < r.rank_m || (l.rank_m == r.rank_m && l.pair > r.pair);
};

Real sphere_distance(const PieceSphere& a_w, const PieceSphere& b_w) noexcept {
  const Real between = std::sqrt((a_w.centre - b_w.centre).squaredNorm());
  const Real size = std::sqrt(a_w.centre.squaredNorm()) + std::sqrt(b_w.centre.squaredNorm()) +
                    a_w.radius_m + b_w.radius_m;
  return between - (a_w.radius_m + b_w.radius_m) - 32 * kRealEpsilon * size;
}

}  // namespace

void NearPairs::place(Arena& arena, const SceneView& scene, std::uint32_t slots,
                      bool screened) noexcept {
  pool_.pairs = arena.take<NearPair>(slots);
  pool_.listed = BoundedList<std::uint32_t>(arena.take<std::uint32_t>(slots));
  pool_.free = BoundedList<std::uint32_t>(arena.take<std::uint32_t>(slots));
  pool_.table = arena.take<std::uint32_t>(std::bit_ceil(4 * std::size_t{slots}));
  if (screened) return;
  const std::uint32_t of_a = scene.bodies()[0].piece_count;
  const auto pieces = static_cast<std::uint32_t>(scene.pieces().size());
  // Spheres round facets are mostly empty, and so are those round the bars and plates of which a
  // scene has more pairs than slots.
  const bool overflows = scene.pair_count() > slots;
  const bool boxed = scene.has_facets() || overflows;
  pieces_.tree_a.place(arena, of_a, boxed);
  pieces_.tree_b.place(arena, pieces - of_a, boxed);
  pieces_.spheres = arena.take<PieceSphere>(pieces);
  if (boxed) {
    pieces_.boxes = arena.take<PieceBox>(pieces);
    if (scene.has_facets()) pieces_.flat = arena.take<FlatPiece>(pieces);
    next_.placed = arena.take<PlacedBox>(2 * std::size_t{of_a} - 1);
  }
  pool_.changed = BoundedList<std::uint32_t>(arena.take<std::uint32_t>(slots));
  next_.at = arena.take<Place>(1);
  next_.waiting = arena.take<NodePair>(kMostWaiting);
  next_.found = BoundedList<Found>(arena.take<Found>(slots));
  used_.left_out = BoundedList<LeftOut>(arena.take<LeftOut>(overflows ? kMostLeftOut : 0));
  next_.leaving = BoundedList<LeftOut>(arena.take<LeftOut>(overflows ? kMostLeftOut : 0));
}

void NearPairs::read_scene(const SceneView& scene) noexcept {
  scene_ = &scene;
  if (pieces_.spheres.empty()) return reset();
  const std::uint32_t of_a = scene.bodies()[0].piece_count;
  for (std::uint32_t i = 0; i < pieces_.spheres.size(); ++i) {
    const PieceRecord& piece = scene.pieces()[i];
    PieceSphere& sphere = pieces_.spheres[i];
    sphere.centre = piece_centre(piece);
    sphere.radius_m = static_cast<Real>(piece.radius_m) * (1 + 4 * kRealEpsilon);
    Vec3 reference = Vec3::Zero();
    if (i >= of_a) {
      const BodyRecord& body = scene.bodies()[piece.body];
      for (int k = 0; k < 3; ++k) reference[k] = static_cast<Real>(body.reference_m[k]);
      sphere.centre += reference;
    }
    if (pieces_.boxes.empty()) continue;
    const PieceView view = scene.piece(i);
    Vec3 low = view.vertex(0), high = low;
    for (std::uint32_t v = 1; v < view.vertex_count; ++v) {
      low = low.cwiseMin(view.vertex(v));
      high = high.cwiseMax(view.vertex(v));
    }
    pieces_.boxes[i] = {0.5_r * (low + high) + reference, 0.5_r * (high - low)};
    if (pieces_.flat.empty()) continue;
    pieces_.flat[i] = FlatPiece{};
    if (!view.is_facet()) continue;
    pieces_.flat[i] = {view.plane_normal(0), view.plane_offset(0), view.vertices, view.vertex_count,
                       reference};
  }
  const std::size_t boxed_a = pieces_.boxes.empty() ? 0 : of_a;
  pieces_.tree_a.build(pieces_.spheres.first(of_a), pieces_.boxes.first(boxed_a));
  pieces_.tree_b.build(pieces_.spheres.subspan(of_a), pieces_.boxes.subspan(boxed_a));
  reset();
}

void NearPairs::reset() noexcept {
  pool_.listed.clear();
  pool_.changed.clear();
  pool_.free.clear();
  for (auto slot = static_cast<std::uint32_t>(pool_.pairs.size()); slot > 0; --slot) {
    pool_.pairs[slot - 1] = {};
    static_cast<void>(pool_.free.push(slot - 1));
  }
  for (std::uint32_t& entry : pool_.table) entry = 0;
  used_.number = next_.number = 0;
  for (PlacedBox& placed : next_.placed) placed.list = 0;
  next_.begun = used_.overflowed = false;
  used_.least_share = 1;
  if (!next_.at.empty()) next_.at[0] = Place{};
  used_.left_out.clear();
  used_.clear_until_m = -std::numeric_limits<double>::max();
}

/// Where the table has a pair at the earliest.
std::uint32_t NearPairs::place_of(PairIndex pair) const noexcept {
  const auto mask = static_cast<std::uint32_t>(pool_.table.size() - 1);
  const auto folded = static_cast<std::uint32_t>(pair ^ pair >> 32);
  return (folded * 0x9e3779b9u) >> 7 & mask;
}

/// Where the table has a pair, or would have it.
const std::uint32_t* NearPairs::entry_of(PairIndex pair) const noexcept {
  const auto mask = static_cast<std::uint32_t>(pool_.table.size() - 1);
  std::uint32_t at = place_of(pair);
  while (pool_.table[at] != 0 && pool_.pairs[pool_.table[at] - 1].pair != pair)
    at = (at + 1) & mask;
  return &pool_.table[at];
}
std::uint32_t* NearPairs::entry_of(PairIndex pair) noexcept {
  return const_cast<std::uint32_t*>(std::as_const(*this).entry_of(pair));
}

std::uint32_t NearPairs::add(std::uint32_t piece_a, std::uint32_t piece_b, Real gap_m) noexcept {
  const PairIndex pair = scene_->find_pair(piece_a, scene_->bodies()[0].piece_count + piece_b);
  std::uint32_t& entry = *entry_of(pair);
  if (entry != 0) return entry - 1;
  if (pool_.free.empty()) return kNoSlot;
  const std::uint32_t slot = pool_.free[pool_.free.size() - 1];
  pool_.free.truncate(pool_.free.size() - 1);
  used_.number = 1;
  pool_.pairs[slot] = {pair, gap_m, used_.number, false, false};
  static_cast<void>(pool_.listed.push(slot));
  entry = slot + 1;
  return slot;
}

void NearPairs::remove(std::uint32_t slot) noexcept {
  const auto mask = static_cast<std::uint32_t>(pool_.table.size() - 1);
  auto hole = static_cast<std::uint32_t>(entry_of(pool_.pairs[slot].pair) - pool_.table.data());
  // What has been put behind it moves up.
  for (std::uint32_t at = (hole + 1) & mask; pool_.table[at] != 0; at = (at + 1) & mask) {
    const std::uint32_t earliest = place_of(pool_.pairs[pool_.table[at] - 1].pair);
    if (((at - earliest) & mask) < ((at - hole) & mask)) continue;
    pool_.table[hole] = pool_.table[at];
    hole = at;
  }
  pool_.table[hole] = 0;
  pool_.pairs[slot].listed = 0;
  static_cast<void>(pool_.free.push(slot));
  std::uint32_t kept = 0;
  for (const std::uint32_t other : pool_.listed) {
    if (other != slot) pool_.listed[kept++] = other;
  }
  pool_.listed.truncate(kept);
}

void NearPairs::fill_table() noexcept {
  std::fill(pool_.table.begin(), pool_.table.end(), 0u);
  for (std::uint32_t slot = 0; slot < pool_.pairs.size(); ++slot) {
    if (pool_.pairs[slot].listed == 0) continue;
    *entry_of(pool_.pairs[slot].pair) = slot + 1;
  }
}

/// The box of a node of A, placed once in a list.
const PieceBox& NearPairs::box_w(std::uint32_t node_a) noexcept {
  PlacedBox& placed = next_.placed[node_a];
  if (placed.list != next_.number) {
    const PieceBox& box = pieces_.tree_a.box(node_a);
    placed = {
        {next_.at[0].p.r_wa * box.middle + next_.at[0].p.x0_w, next_.at[0].turn_abs * box.half},
        next_.number};
  }
  return placed.box_w;
}

/// What a node of A has of the range: the share of the radius that its lever has, or the least.
Real NearPairs::share_of(std::uint32_t node_a) const noexcept {
  const Place& at = next_.at[0];
  if (!(at.least_share < 1)) return 1;
  const PieceSphere& sphere = pieces_.tree_a.node(node_a).sphere;
  const Real lever_m = std::sqrt(sphere.centre.squaredNorm()) + sphere.radius_m;
  return std::clamp(lever_m * (1 + 4 * kRealEpsilon) / at.radius_m, at.least_share, Real{1});
}

/// True if the pieces of two nodes are farther apart than a share of the range: their spheres are,
/// or where there are boxes these are, along the axes of either. Of two leaves within it `gap_m` is
/// the lower bound that says so.
bool NearPairs::is_beyond(std::uint32_t node_a, std::uint32_t node_b, Real share,
                          Real& gap_m) noexcept {
  const Place& at = next_.at[0];
  const PieceNode &a = pieces_.tree_a.node(node_a), &b = pieces_.tree_b.node(node_b);
  if (pieces_.boxes.empty()) {
    gap_m = sphere_distance({at.p.r_wa * a.sphere.centre + at.p.x0_w, a.sphere.radius_m}, b.sphere);
    if (gap_m > share * next_.range_m) next_.left_m = std::min(next_.left_m, gap_m / share);
    return gap_m > share * next_.range_m;
  }
  const Real limit_m = share * next_.range_m + at.rounding_m;
  const auto squared = [](const Vec3& between, const Vec3& halves) {
    return (between.cwiseAbs() - halves).cwiseMax(Vec3::Zero()).squaredNorm();
  };
  const PieceBox &a_w = box_w(node_a), &b_w = pieces_.tree_b.box(node_b);
  const Vec3 between_w = a_w.middle - b_w.middle;
  Real apart2 = squared(between_w, a_w.half + b_w.half);
  if (apart2 <= limit_m * limit_m) {
    apart2 = std::max(apart2, squared(at.turn_back * between_w, pieces_.tree_a.box(node_a).half +
                                                                    at.turn_back_abs * b_w.half));
  }
  if (apart2 > limit_m * limit_m) {
    next_.left2 = std::min(next_.left2, apart2 / (share * share));
    return true;
  }
  if (a.count == 1 && b.count == 1) gap_m = std::sqrt(apart2) - at.rounding_m;
  return false;
}

/// A better lower bound of the gap between two facets than `gap_m`: of the plane of each; as far as
/// it takes to be above `limit_m`.
Real NearPairs::facet_gap(std::uint32_t piece_a, std::uint32_t piece_b, Real gap_m,
                          Real limit_m) const noexcept {
  if (pieces_.flat.empty()) return gap_m;
  const FlatPiece &a = pieces_.flat[piece_a], &b = pieces_.flat[piece_b];
  if (a.corner_count == 0 || b.corner_count == 0) return gap_m;
  const Place& at = next_.at[0];
  const Vec3 between_w = at.p.x0_w - b.reference_m;
  const auto beyond = [&](const FlatPiece& piece, const Vec3& normal, Real offset_m) {
    Real least = std::numeric_limits<Real>::max(), most = -least;
    for (std::uint32_t v = 0; v < piece.corner_count; ++v) {
      const Real height = normal.dot(ConstVec3Map(piece.corners + 3 * std::size_t{v})) + offset_m;
      least = std::min(least, height);
      most = std::max(most, height);
    }
    return std::max(least, -most) - at.rounding_m;
  };
  gap_m = std::max(gap_m, beyond(a, at.turn_back * b.normal, b.normal.dot(between_w) - b.offset_m));
  if (gap_m > limit_m) return gap_m;
  const Vec3 normal_w = at.p.r_wa * a.normal;
  return std::max(gap_m, beyond(b, normal_w, -normal_w.dot(between_w) - a.offset_m));
}

void NearPairs::begin(const GripPose& p, double odometer_m, Real range_m, Real least_share,
                      Real radius_m) noexcept {
  next_.begun = true;
  next_.number += 1;
  const Mat3 back = p.r_wa.transpose();
  const PieceSphere &all_a = pieces_.tree_a.node(0).sphere, &all_b = pieces_.tree_b.node(0).sphere;
  const Real size_m = p.x0_w.cwiseAbs().sum() + all_a.radius_m + all_b.radius_m +
                      std::sqrt(all_a.centre.squaredNorm()) + std::sqrt(all_b.centre.squaredNorm());
  next_.at[0] = {p,        p.r_wa.cwiseAbs(), back, back.cwiseAbs(), 64 * kRealEpsilon * size_m,
                 radius_m, least_share};
  next_.odometer_m = odometer_m;
  next_.range_m = range_m;
  next_.left_m = next_.left2 = std::numeric_limits<Real>::max();
  next_.waiting[0] = NodePair{};
  next_.waiting_count = 1;
  next_.visited = 0;
  next_.found.clear();
  next_.leaving.clear();
  next_.refining = next_.leaves_pairs = false;
  next_.refined = 0;
}

/// There is no room for all pairs within the range: a lower bound of the gap of this one that is as
/// good as a face of either piece makes it, or as it takes to be above the range.
void NearPairs::refine(Found& found) noexcept {
  const GripPose& p = next_.at[0].p;
  const PairView view = scene_->pair(found.pair);
  const BodyRecord& body = scene_->bodies()[view.b.record->body];
  Vec3 y_w = p.x0_w;
  for (int k = 0; k < 3; ++k) y_w[k] -= static_cast<Real>(body.reference_m[k]);
  const Real rounding_m = gap_rounding(view, y_w);
  found.along_m = -std::numeric_limits<Real>::max();
  const auto improve = [&](const PlaneGap& gap) {
    next_.visited += kListVisitsOfUnit;
    if (!gap.defined || !(gap.gap_m - rounding_m > found.along_m)) return;
    found.along_m = gap.gap_m - rounding_m;
    found.normal_w = gap.normal_w;
  };
  SupportPair support{};
  const auto ask = [&](ContactType type, std::uint32_t count) {
    for (std::uint32_t f = 0; f < count && !(found.along_m > next_.range_m); ++f) {
      PlaneId id;
      id.type = type;
      (type == ContactType::kA ? id.i : id.j) = static_cast<std::uint16_t>(f);
      next_.visited += 1;
      if (face_bound(view, p.r_wa, y_w, id, support) < found.along_m) continue;
      const PlaneGap gap = plane_gap(view, p.r_wa, y_w, id, support);
      support = gap.support;
      improve(gap);
    }
  };
  ask(ContactType::kB, plane_count(*view.b.record));
  // A solid of many faces is mostly apart from a facet along the planes of that.
  const std::uint32_t of_a = plane_count(*view.a.record);
  const bool is_apart = view.b.is_facet() && found.along_m > 0;
  if (of_a <= kFewFaces || !is_apart) ask(ContactType::kA, of_a);
  if (kSceneTraits.facets && found.along_m < kLineShare * next_.range_m)
    ask_edges(found, view, y_w);
  found.rank_m = found.gap_m = std::max(found.gap_m, found.along_m);
}

/// Facets side by side look near along their planes: the line between their nearest edges tells how
/// far apart they are.
void NearPairs::ask_edges(Found& found, const PairView& view, const Vec3& y_w) noexcept {
  const std::uint32_t lines = view.a.edge_count * view.b.edge_count;
  if (!view.has_facet() || lines > kMostEdgeLines) return;
  const Mat3& r_wa = next_.at[0].p.r_wa;
  next_.visited += lines + 2 * kListVisitsOfUnit;
  Vec3 nearest_w = Vec3::Zero();
  Real length2 = std::numeric_limits<Real>::max();
  for (std::uint32_t i = 0; i < view.a.edge_count; ++i) {
    for (std::uint32_t j = 0; j < view.b.edge_count; ++j) {
      const Vec3 line_w = line_between_edges_m(view, r_wa, y_w, i, j);
      if (!(line_w.squaredNorm() < length2)) continue;
      nearest_w = line_w;
      length2 = line_w.squaredNorm();
    }
  }
  const Real length = std::sqrt(length2);
  if (!(length > 0) || !(length > found.along_m)) return;
  const DirectionGap gap = direction_gap(view, r_wa, y_w, nearest_w / length, {});
  const Real along_m = gap.gap_m - gap_rounding(view, y_w);
  if (!(along_m > found.along_m)) return;
  found.along_m = along_m;
  found.normal_w = gap.normal_w;
}

/// The list is full: of the pairs that it holds, one after the other, a better gap. Then those
/// beyond the range leave it.
void NearPairs::refine_next() noexcept {
  refine(next_.found[next_.refined]);
  if (++next_.refined < next_.found.size()) return;
  std::uint32_t kept = 0;
  for (const Found& found : next_.found) {
    if (found.gap_m > next_.range_m) {
      next_.left_m = std::min(next_.left_m, found.gap_m);
    } else {
      next_.found[kept++] = found;
    }
  }
  next_.found.truncate(kept);
  next_.refined = next_.found.capacity();
  if (next_.found.size() == next_.found.capacity())
    std::make_heap(next_.found.begin(), next_.found.end(), is_nearer);
}

bool NearPairs::go_on(std::uint32_t most_visits, double odometer_m, Real least_m) noexcept {
  const std::uint32_t of_a = scene_->bodies()[0].piece_count;
  const std::uint32_t begin = next_.visited;
  while (next_.waiting_count > 0 || has_to_refine()) {
    if (next_.visited - begin >= most_visits) return false;
    if (has_to_refine()) {
      refine_next();
      continue;
    }
    const NodePair next = next_.waiting[--next_.waiting_count];
    next_.visited += 1;
    const PieceNode& a = pieces_.tree_a.node(next.a);
    const PieceNode& b = pieces_.tree_b.node(next.b);
    Real gap_m = 0;
    const Real share = share_of(next.a);
    if (is_beyond(next.a, next.b, share, gap_m)) continue;
    if (a.count == 1 && b.count == 1) {
      const PairIndex pair =
          scene_->find_pair(pieces_.tree_a.piece(a), of_a + pieces_.tree_b.piece(b));
      if (pair == kNoPair) continue;
      const bool is_short =
          next_.found.size() == next_.found.capacity() && !(next_.found[0].rank_m > least_m);
      if (is_short && !next_.refining && may_leave_out()) {
        next_.refining = true;
        next_.waiting[next_.waiting_count++] = next;
        continue;
      }
      const Real limit_m = share * next_.range_m;
      const Real closer =
          facet_gap(pieces_.tree_a.piece(a), of_a + pieces_.tree_b.piece(b), gap_m, limit_m);
      if (closer > limit_m) {
        next_.left_m = std::min(next_.left_m, closer / share);
      } else {
        take({pair, closer, closer / share, 0, Vec3::Zero()});
      }
    } else if (b.count == 1 || (a.count > 1 && a.sphere.radius_m > b.sphere.radius_m)) {
      next_.waiting[next_.waiting_count++] = {a.child + 1, next.b};
      next_.waiting[next_.waiting_count++] = {a.child, next.b};
    } else {
      next_.waiting[next_.waiting_count++] = {next.a, b.child + 1};
      next_.waiting[next_.waiting_count++] = {next.a, b.child};
    }
  }
  finish(odometer_m);
  return true;
}

/// Takes a pair into the list that is begun; where that is full, in place of the farthest.
void NearPairs::take(Found found) noexcept {
  if (is_refining()) {
    refine(found);
    if (found.gap_m > next_.range_m) {
      next_.left_m = std::min(next_.left_m, found.gap_m);
      return;
    }
  }
  if (next_.found.push(found)) {
    if (next_.found.size() == next_.found.capacity())
      std::make_heap(next_.found.begin(), next_.found.end(), is_nearer);
    return;
  }
  next_.leaves_pairs = true;
  const Found farthest = next_.found[0];
  const bool has_farther = farthest.rank_m > found.rank_m;
  if (is_refining()) {
    leave_out(has_farther ? farthest : found);
  } else {
    next_.left_m = std::min(next_.left_m, has_farther ? farthest.rank_m : found.rank_m);
    next_.range_m = std::min(next_.range_m, farthest.rank_m);
  }
  if (!has_farther) return;
  std::pop_heap(next_.found.begin(), next_.found.end(), is_nearer);
  next_.found[next_.found.size() - 1] = found;
  std::push_heap(next_.found.begin(), next_.found.end(), is_nearer);
}

/// A pair that has no slot, as a group of its own.
LeftOut NearPairs::left_out_of(const Found& found) const noexcept {
  const std::uint32_t piece = scene_->pair(found.pair).record.piece_a;
  const Vec3& n = found.normal_w;
  const Vec3 across = (Vec3::Ones() - n.cwiseAbs2()).cwiseMax(Vec3::Zero()).cwiseSqrt();
  LeftOut left;
  left.normal_w = n;
  left.reach_m = static_cast<Real>(scene_->pieces()[piece].reach_m) * (1 + kRealEpsilon);
  left.gap_m = found.along_m;
  left.moment_m = (next_.at[0].p.r_wa * pieces_.spheres[piece].centre).cross(n);
  left.moment_spread_m =
      pieces_.spheres[piece].radius_m * across + Vec3::Constant(16 * kRealEpsilon * left.reach_m);
  return left;
}

/// A pair within the range that has no slot: with those along whose faces it is apart in about the
/// same direction.
void NearPairs::leave_out(const Found& found) noexcept {
  if (!may_leave_out() || found.normal_w.isZero(0)) {
    next_.left_m = std::min(next_.left_m, found.gap_m);
    return;
  }
  LeftOut next = left_out_of(found);
  // Of the groups, `next` among them, those two are one from now on that leave a motion along their
  // faces most room: its share that their box takes, over their gap.
  struct Joint {
    std::uint32_t into = 0;
    Real cost = std::numeric_limits<Real>::max();
  };
  const auto best_for = [&](const LeftOut& group, std::uint32_t count) {
    Joint best;
    for (std::uint32_t k = 0; k < count; ++k) {
      const LeftOut both = joined(next_.leaving[k], group);
      const Real room_m = std::max(both.gap_m, kLeastJoinRoom * next_.range_m);
      const Real cost = both.spread.squaredNorm() / (room_m * room_m);
      if (cost < best.cost) best = {k, cost};
    }
    return best;
  };
  Joint best = best_for(next, next_.leaving.size());
  const bool is_known =
      next_.leaving.size() > 0 && joined(next_.leaving[best.into], next).spread.squaredNorm() <=
                                      kSameDirection * kSameDirection;
  if (!is_known && next_.leaving.push(next)) return;
  // A list that is finished has no more visits to spend.
  if (!is_known && next_.begun) {
    next_.visited += kJoinVisits;
    std::uint32_t freed = next_.leaving.size();
    for (std::uint32_t k = 1; k < next_.leaving.size(); ++k) {
      const Joint other = best_for(next_.leaving[k], k);
      if (!(other.cost < best.cost)) continue;
      best = other;
      freed = k;
    }
    if (freed < next_.leaving.size()) std::swap(next, next_.leaving[freed]);
  }
  next_.leaving[best.into] = joined(next_.leaving[best.into], next);
}

void NearPairs::follow(const Vec3& dx_m, const Vec3& dtheta_rad) noexcept {
  for (LeftOut& left : left_out()) haptic::follow(left, dx_m, dtheta_rad);
}

/// The list that was begun takes the place of the one before.
void NearPairs::finish(double odometer_m) noexcept {
  next_.begun = false;
  used_.least_share = next_.at[0].least_share;
  used_.overflowed = next_.leaves_pairs;
  used_.number += 1;
  for (NearPair& pair : pool_.pairs) {
    pair.changed = false;
    if (pair.pinned) pair.listed = used_.number;
  }
  // Where a heap leaves its elements is up to the library of C++.
  if (next_.refining || next_.found.size() == next_.found.capacity()) {
    std::make_heap(next_.found.begin(), next_.found.end(), is_nearer);
    std::sort_heap(next_.found.begin(), next_.found.end(), is_nearer);
  }
  fill_table();
  std::uint32_t others = 0;  // pairs that have no slot yet come first
  for (const Found& found : next_.found) {
    const std::uint32_t known = *entry_of(found.pair);
    if (known == 0) {
      next_.found[others++] = found;
      continue;
    }
    pool_.pairs[known - 1].gap_m = found.gap_m;
    pool_.pairs[known - 1].listed = used_.number;
  }
  std::uint32_t cursor = 0;
  for (std::uint32_t k = 0; k < others; ++k) put(next_.found[k], cursor);
  pool_.listed.clear();
  pool_.changed.clear();
  for (std::uint32_t slot = 0; slot < pool_.pairs.size(); ++slot) {
    NearPair& pair = pool_.pairs[slot];
    pair.pinned = false;
    if (pair.listed == used_.number) {
      static_cast<void>(pool_.listed.push(slot));
    } else if (pair.listed != 0) {
      pair.listed = 0;
      pair.changed = true;
      static_cast<void>(pool_.free.push(slot));
    }
    if (pair.changed) static_cast<void>(pool_.changed.push(slot));
  }
  if (next_.left2 < std::numeric_limits<Real>::max()) {
    next_.left_m =
        std::min(next_.left_m, std::sqrt(next_.left2) - next_.at[0].rounding_m / used_.least_share);
  }
  used_.clear_until_m = next_.odometer_m + static_cast<double>(next_.left_m);
  // The part has gone on since the list was begun.
  used_.left_out.clear();
  const Real since_m = static_cast<Real>(odometer_m - next_.odometer_m) * (1 + kRealEpsilon);
  for (LeftOut left : next_.leaving) {
    left.gap_m -= since_m;
    left.moment_spread_m += Vec3::Constant(since_m);
    static_cast<void>(used_.left_out.push(left));
  }
}

/// Puts a pair into a free slot, or that of a pair which is not in the list any more.
void NearPairs::put(const Found& found, std::uint32_t& cursor) noexcept {
  std::uint32_t slot = kNoSlot;
  if (!pool_.free.empty()) {
    slot = pool_.free[pool_.free.size() - 1];
    pool_.free.truncate(pool_.free.size() - 1);
  } else {
    while (cursor < pool_.pairs.size() && pool_.pairs[cursor].listed == used_.number) ++cursor;
    if (cursor < pool_.pairs.size()) slot = cursor;
  }
  if (slot == kNoSlot) {  // pairs that must stay have left no room
    used_.overflowed = true;
    leave_out(found);
    return;
  }
  pool_.pairs[slot] = {found.pair, found.gap_m, used_.number, true, false};
}

}  // namespace haptic
