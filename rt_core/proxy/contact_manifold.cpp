// SPDX-License-Identifier: Apache-2.0
#include "rt_core/proxy/contact_manifold.hpp"

#include <algorithm>
#include <cmath>

#include "rt_core/proxy/support_feature.hpp"

namespace haptic {
namespace {

/// Points closer than this share of the smaller piece's radius are one: a row more would gain a
/// fiftieth of that at the largest turn of a pass.
constexpr Real kMergeShare = 1.0e-6_r;
/// Rounding of coordinates in the plane, as a share of the pair's size.
constexpr Real kBandShare = 8 * kRealEpsilon;

/// The pair as the plane sees it and the points collected so far. The plane's origin is the support
/// vertex of B.
struct Region {
  PieceShadow shadow_a, shadow_b;
  SupportFeature a, b;
  Vec3 normal_w, e1_w, e2_w;
  Vec3 origin_w;  ///< support vertex of B about x_0^A [m]
  Real band_m = 0, merge_m = 0, edge_width_m = 0;
  ContactType type = ContactType::kA;
  std::array<PlanePoint, kMaxManifoldPoints> spots;
  std::array<Real, kMaxManifoldPoints> gaps;
  std::uint32_t count = 0;

  [[nodiscard]] Real gap_at(const PlanePoint& spot) const noexcept {
    return a.height_at(spot) - b.height_at(spot);
  }
  [[nodiscard]] bool full() const noexcept { return count == kMaxManifoldPoints; }
};

bool close(const PlanePoint& p, const PlanePoint& q, Real distance_m) noexcept {
  return std::abs(p.x - q.x) <= distance_m && std::abs(p.y - q.y) <= distance_m;
}

/// Adds a point to the region unless it is there already.
void add_spot(Region& region, const PlanePoint& spot) noexcept {
  const Real gap = region.gap_at(spot);
  for (std::uint32_t k = 0; k < region.count; ++k) {
    if (!close(region.spots[k], spot, region.merge_m)) continue;
    if (gap < region.gaps[k]) {
      region.gaps[k] = gap;
      region.spots[k] = spot;
    }
    return;
  }
  if (region.full()) return;
  region.spots[region.count] = spot;
  region.gaps[region.count++] = gap;
}

/// Calls `visit(from, to)` for the sides of a face's shadow, counter-clockwise in the plane, until
/// it returns false. Corners within `shortest_m` of the last one are passed over: their side has
/// no direction beyond rounding.
template <typename Visit>
void for_each_side(const PieceShadow& shadow, std::uint32_t f, Real shortest_m,
                   const Visit& visit) noexcept {
  const std::span<const std::uint16_t> loop = shadow.piece->face_vertices(f);
  const bool backward = shadow.sense < 0;  // seen from inside the piece
  PlanePoint from = shadow.spot(backward ? loop.front() : loop.back());
  for (std::size_t k = 0; k < loop.size(); ++k) {
    const PlanePoint to = shadow.spot(loop[backward ? loop.size() - 1 - k : k]);
    if (close(from, to, shortest_m)) continue;
    if (!visit(from, to)) return;
    from = to;
  }
}

/// A stretch of a segment by its parameters.
struct Stretch {
  Real begin = 0, end = 1;

  /// Keeps what lies where a linear function, given at the segment's ends, is not positive; the
  /// function's rounding is `band`. False: nothing does.
  [[nodiscard]] bool keep(Real at_0, Real at_1, Real band) noexcept {
    if (at_0 > band && at_1 > band) return false;
    if (at_0 > band) begin = std::max(begin, at_1 < 0 ? at_0 / (at_0 - at_1) : Real{1});
    if (at_1 > band) end = std::min(end, at_0 < 0 ? at_0 / (at_0 - at_1) : Real{0});
    return begin <= end;
  }
};

/// An edge's ends in the plane; a vertex is an edge without length.
struct Segment {
  PlanePoint from, way;

  [[nodiscard]] PlanePoint at(Real share) const noexcept {
    // From the nearer end, so that both ends come out without rounding of the way.
    return share <= 0.5_r ? PlanePoint{from.x + share * way.x, from.y + share * way.y}
                          : PlanePoint{from.x + way.x - (1 - share) * way.x,
                                       from.y + way.y - (1 - share) * way.y};
  }
};

Segment segment_of(const PieceShadow& shadow, const SupportFeature& feature) noexcept {
  if (feature.kind == FeatureKind::kVertex) return {shadow.spot(feature.index), {}};
  const EdgeRecord& edge = shadow.piece->edges[feature.index];
  const PlanePoint from = shadow.spot(edge.vertex[0]);
  return {from, shadow.spot(edge.vertex[1]) - from};
}

void add_stretch(Region& region, const Segment& segment, const Stretch& stretch) noexcept {
  add_spot(region, segment.at(stretch.begin));
  add_spot(region, segment.at(stretch.end));
}

void segment_on_face(Region& region, const Segment& segment, const PieceShadow& shadow,
                     std::uint32_t f) noexcept {
  Stretch stretch;
  bool any = true;
  const PlanePoint end = segment.from - PlanePoint{-segment.way.x, -segment.way.y};
  for_each_side(shadow, f, region.edge_width_m, [&](const PlanePoint& from, const PlanePoint& to) {
    const PlanePoint side = to - from;
    const Real band = region.band_m * (std::abs(side.x) + std::abs(side.y));
    any = stretch.keep(cross(segment.from - from, side), cross(end - from, side), band);
    return any;
  });
  if (any) add_stretch(region, segment, stretch);
}

/// Crossing of two edges, or the stretch along which they lie on each other. `along` has a length
/// unless both are vertices.
void segment_on_segment(Region& region, const Segment& along, const Segment& other) noexcept {
  const Real length2 = dot(along.way, along.way);
  if (!(length2 > 0)) return;
  const Real length = std::sqrt(length2);
  const PlanePoint to_0 = other.from - along.from;
  const PlanePoint to_1{to_0.x + other.way.x, to_0.y + other.way.y};
  const Real s_0 = dot(along.way, to_0) / length, s_1 = dot(along.way, to_1) / length;
  Stretch stretch;  // of the other between the ends of `along`
  if (!stretch.keep(-s_0, -s_1, region.edge_width_m) ||
      !stretch.keep(s_0 - length, s_1 - length, region.edge_width_m)) {
    return;
  }
  const Real side_0 = cross(along.way, to_0) / length, side_1 = cross(along.way, to_1) / length;
  const Real at_begin = side_0 + stretch.begin * (side_1 - side_0);
  const Real at_end = side_0 + stretch.end * (side_1 - side_0);
  const bool begin_on = std::abs(at_begin) <= region.edge_width_m;
  const bool end_on = std::abs(at_end) <= region.edge_width_m;
  if (begin_on) add_spot(region, other.at(stretch.begin));
  if (end_on) add_spot(region, other.at(stretch.end));
  if (!begin_on && !end_on && (at_begin < 0) != (at_end < 0)) {
    const Real share = at_begin / (at_begin - at_end);
    add_spot(region, other.at(stretch.begin + share * (stretch.end - stretch.begin)));
  }
}

/// Of neighbouring corners that are one point leaves that with the smaller gap, and returns the
/// corner with the smallest of all. `count`: corners left.
std::uint16_t merge_corners(const Region& region, ConvexPolygon& polygon,
                            std::uint32_t& count) noexcept {
  std::uint16_t at = polygon.first();
  std::uint16_t lowest = at;
  Real at_gap = region.gap_at(polygon.point(at));
  Real least = at_gap;
  const std::uint16_t start = at;
  count = 1;
  const std::uint32_t bound = polygon.bound();
  for (std::uint32_t k = 0; k < bound; ++k) {
    const std::uint16_t next = polygon.next(at);
    if (next == start) break;
    const Real gap = region.gap_at(polygon.point(next));
    const bool one = close(polygon.point(at), polygon.point(next), region.merge_m);
    if (one && !(gap < at_gap)) {
      polygon.remove(next);
      continue;
    }
    if (one && at != start) {
      polygon.remove(at);
    } else {
      ++count;
    }
    at = next;
    at_gap = gap;
    if (gap < least) {
      least = gap;
      lowest = at;
    }
  }
  return lowest;
}

/// The corner of the ring that lies farthest outside the line between two chosen ones.
struct Arc {
  std::uint16_t from = 0, to = 0, farthest = 0;
  Real beyond_m = 0;
};

Arc arc_between(const ConvexPolygon& polygon, std::uint16_t from, std::uint16_t to) noexcept {
  Arc arc{from, to, from, 0};
  const PlanePoint start = polygon.point(from);
  const PlanePoint side = polygon.point(to) - start;
  const std::uint32_t bound = polygon.bound();
  std::uint16_t at = polygon.next(from);
  for (std::uint32_t k = 0; k < bound && at != to; ++k, at = polygon.next(at)) {
    const Real beyond = cross(polygon.point(at) - start, side);
    if (beyond > arc.beyond_m) {
      arc.beyond_m = beyond;
      arc.farthest = at;
    }
  }
  const Real length2 = dot(side, side);
  arc.beyond_m = length2 > 0 ? arc.beyond_m / std::sqrt(length2) : Real{0};
  return arc;
}

/// Adds the corners that tell most of a region with more than fit: the one with the smallest gap,
/// the one farthest from it, then again and again what lies farthest outside the hull of those
/// chosen.
void add_farthest(Region& region, const ConvexPolygon& polygon, std::uint16_t lowest) noexcept {
  add_spot(region, polygon.point(lowest));
  std::uint16_t opposite = lowest;
  Real most = 0;
  std::uint16_t at = polygon.next(lowest);
  const std::uint32_t bound = polygon.bound();
  for (std::uint32_t k = 0; k < bound && at != lowest; ++k, at = polygon.next(at)) {
    const PlanePoint way = polygon.point(at) - polygon.point(lowest);
    const Real distance2 = dot(way, way);
    if (distance2 > most) {
      most = distance2;
      opposite = at;
    }
  }
  add_spot(region, polygon.point(opposite));
  std::array<Arc, kMaxManifoldPoints> arcs;
  arcs[0] = arc_between(polygon, lowest, opposite);
  arcs[1] = arc_between(polygon, opposite, lowest);
  for (std::uint32_t count = 2; count < kMaxManifoldPoints; ++count) {
    Arc& widest =
        *std::max_element(arcs.begin(), arcs.begin() + count,
                          [](const Arc& l, const Arc& r) { return l.beyond_m < r.beyond_m; });
    if (!(widest.beyond_m > 0)) return;
    const Arc split = widest;
    add_spot(region, polygon.point(split.farthest));
    widest = arc_between(polygon, split.from, split.farthest);
    arcs[count] = arc_between(polygon, split.farthest, split.to);
  }
}

void face_on_face(Region& region, ConvexPolygon& polygon) noexcept {
  polygon.clear();
  for (const std::uint16_t v : region.shadow_b.piece->face_vertices(region.b.index)) {
    polygon.add(region.shadow_b.spot(v));
  }
  bool any = true;
  for_each_side(region.shadow_a, region.a.index, region.edge_width_m,
                [&](const PlanePoint& from, const PlanePoint& to) {
                  any = polygon.cut(from, to, region.band_m);
                  return any;
                });
  if (!any) return;
  std::uint32_t count = 0;
  std::uint16_t at = merge_corners(region, polygon, count);
  if (count <= kMaxManifoldPoints) {
    for (std::uint32_t k = 0; k < count; ++k, at = polygon.next(at)) {
      add_spot(region, polygon.point(at));
    }
    return;
  }
  add_farthest(region, polygon, at);
}

/// The two pieces in the plane: coordinates and heights about the support vertex of B.
void look_along(const PairView& pair, const Mat3& r_wa, const Vec3& y_w, const PlaneGap& gap,
                Region& region) noexcept {
  const PlaneBasis basis = plane_basis(gap.normal_w);
  region.normal_w = gap.normal_w;
  region.e1_w = basis.e1;
  region.e2_w = basis.e2;
  const Vec3 vertex_b = pair.b.vertex(gap.support.b);
  region.origin_w = vertex_b - y_w;
  PieceShadow& a = region.shadow_a;
  a.piece = &pair.a;
  a.e1 = r_wa.transpose() * basis.e1;
  a.e2 = r_wa.transpose() * basis.e2;
  a.outward = -gap.normal_a;
  a.origin = pair.a.vertex(gap.support.a);
  a.at = {a.e1.dot(a.origin) - basis.e1.dot(region.origin_w),
          a.e2.dot(a.origin) - basis.e2.dot(region.origin_w)};
  a.height_m = gap.gap_m;
  a.sense = -1;
  PieceShadow& b = region.shadow_b;
  b.piece = &pair.b;
  b.e1 = basis.e1;
  b.e2 = basis.e2;
  b.outward = gap.normal_w;
  b.origin = vertex_b;
  const Real radius_a = static_cast<Real>(pair.a.record->radius_m);
  const Real radius_b = static_cast<Real>(pair.b.record->radius_m);
  const Real size = radius_a + radius_b;
  region.band_m = kBandShare * size;
  region.merge_m = std::max(kMergeShare * std::min(radius_a, radius_b), 8 * region.band_m);
  region.edge_width_m = applicability_tolerance(size);
}

void intersect(Region& region, ConvexPolygon& polygon) noexcept {
  const bool face_a = region.a.kind == FeatureKind::kFace;
  const bool face_b = region.b.kind == FeatureKind::kFace;
  if (face_a && face_b) {
    face_on_face(region, polygon);
  } else if (face_a) {
    segment_on_face(region, segment_of(region.shadow_b, region.b), region.shadow_a, region.a.index);
  } else if (face_b) {
    segment_on_face(region, segment_of(region.shadow_a, region.a), region.shadow_b, region.b.index);
  } else {
    const Segment a = segment_of(region.shadow_a, region.a);
    const Segment b = segment_of(region.shadow_b, region.b);
    const bool along_a = region.a.kind == FeatureKind::kEdge;
    segment_on_segment(region, along_a ? a : b, along_a ? b : a);
  }
}

/// The corners of the feature that lies across from the plane's face, its support vertex first:
/// where the two do not overlap, the plane still may not be passed by any of them.
void add_corners(Region& region, bool of_a, const SupportPair& support) noexcept {
  const PieceShadow& shadow = of_a ? region.shadow_a : region.shadow_b;
  const SupportFeature& feature = of_a ? region.a : region.b;
  add_spot(region, shadow.spot(of_a ? support.a : support.b));
  if (feature.kind == FeatureKind::kEdge) {
    for (const std::uint32_t v : shadow.piece->edges[feature.index].vertex)
      add_spot(region, shadow.spot(v));
  } else if (feature.kind == FeatureKind::kFace) {
    for (const std::uint16_t v : shadow.piece->face_vertices(feature.index))
      add_spot(region, shadow.spot(v));
  }
}

}  // namespace

ManifoldPoint support_row_point(const PairView& pair, const Mat3& r_wa, const Vec3& y_w,
                                const PlaneGap& gap) noexcept {
  const PlaneId& id = gap.id;
  ManifoldPoint point;
  point.gap_m = gap.gap_m;
  const Vec3 on_b = pair.b.vertex(gap.support.b) - y_w;
  if (id.type == ContactType::kA) {
    point.app_w = on_b;
    return point;
  }
  const Vec3 on_a = r_wa * pair.a.vertex(gap.support.a);
  point.app_w = id.type == ContactType::kB ? on_a : Vec3(0.5_r * (on_a + on_b));
  return point;
}

// The normal is s (u x v) / |u x v| with u of A and s = +-1; u turns by dtheta x u. With the way d
// from B's vertex to A's and d' = s (d - n n.d) / |u x v|, the gap n.d changes by what A's vertex
// moves along n and by d'.((dtheta x u) x v) = (d'.u) v.dtheta - (u.v) d'.dtheta. The first is that
// of the point midway but for half the way d across n.
Vec3 plane_turn(const PairView& pair, const Mat3& r_wa, const Vec3& y_w,
                const PlaneGap& gap) noexcept {
  if (gap.id.type != ContactType::kC) return Vec3::Zero();
  const Vec3 u = r_wa * ConstVec3Map(pair.a.edge_directions[gap.id.i].unit);
  const Vec3 v = ConstVec3Map(pair.b.edge_directions[gap.id.j].unit);
  const Vec3 d = y_w + r_wa * pair.a.vertex(gap.support.a) - pair.b.vertex(gap.support.b);
  const Vec3 across = d - gap.normal_w * gap.normal_w.dot(d);
  const Real sine = u.cross(v).dot(gap.normal_w);  // with the sign of the normal
  const Vec3 lever = across / sine;
  return lever.dot(u) * v - u.dot(v) * lever + (across / 2).cross(gap.normal_w);
}

std::uint32_t contact_manifold(const PairView& pair, const Mat3& r_wa, const Vec3& y_w,
                               const PlaneGap& gap, Real height_m, ManifoldScratch& scratch,
                               std::array<ManifoldPoint, kMaxManifoldPoints>& points) noexcept {
  const PlaneId& id = gap.id;
  Region region;
  look_along(pair, r_wa, y_w, gap, region);
  const bool face_a = id.type == ContactType::kA && !pair.a.is_side(id.i);
  const bool face_b = id.type == ContactType::kB && !pair.b.is_side(id.j);
  region.a = face_a ? level_face(region.shadow_a, id.i)
                    : support_feature(region.shadow_a, gap.support.a, height_m);
  region.b = face_b ? level_face(region.shadow_b, id.j)
                    : support_feature(region.shadow_b, gap.support.b, height_m);
  intersect(region, scratch.polygon);
  scratch.overlap = region.count > 0;
  if (!scratch.overlap && id.type != ContactType::kC) {
    add_corners(region, id.type == ContactType::kB, gap.support);
  }
  if (region.count == 0) {
    points[0] = support_row_point(pair, r_wa, y_w, gap);
    return 1;
  }
  // App on B, on A or midway: the height of B's point plus none, all or half of the gap.
  const Real part = id.type == ContactType::kA ? 0.0_r : id.type == ContactType::kB ? 1.0_r : 0.5_r;
  for (std::uint32_t k = 0; k < region.count; ++k) {
    const PlanePoint& spot = region.spots[k];
    const Real height = region.b.height_at(spot) + part * region.gaps[k];
    points[k].app_w =
        region.origin_w + (spot.x * region.e1_w + spot.y * region.e2_w + height * region.normal_w);
    points[k].gap_m = region.gaps[k];
  }
  return region.count;
}

}  // namespace haptic
