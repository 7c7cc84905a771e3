// SPDX-License-Identifier: Apache-2.0
// The tables of a blob against each other: bodies and pieces. A table that passes is exactly what
// the graph compiler would have written for its pieces, so the servo loop can trust every index.
#include "rt_core/scene/scene_check.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "rt_core/scene/capacity.hpp"
#include "rt_core/scene/derived_check.hpp"
#include "rt_core/scene/scene_view.hpp"

namespace haptic {
namespace {

using check::cross;
using check::dot;
using check::Double3;
using check::vertex_of;

/// `x` lies in [low, high]; false for NaN.
constexpr bool in_range(double x, double low, double high) noexcept {
  return x >= low && x <= high;
}

/// Bit by bit: squares of the smallest numbers are zero too.
bool is_zero(double x) noexcept { return std::bit_cast<std::uint64_t>(x) == 0; }

/// Largest absolute coordinate of the piece, the scale of its rounding; negative when a coordinate
/// is out of range.
double coordinate_scale(const PieceView& p) noexcept {
  double scale = 0.0;
  for (std::size_t i = 0; i < 3 * std::size_t{p.vertex_count}; ++i) {
    const double x = static_cast<double>(p.vertices[i]);
    if (!check::is_coordinate(x)) return -1.0;
    scale = std::max(scale, check::absolute(x));
  }
  return scale;
}

bool counts_fit(const PieceRecord& r) noexcept {
  const bool facet = is_flat(r) && r.vertex_count >= 3 && r.vertex_count == r.edge_count;
  const bool solid = r.vertex_count >= 4 && r.face_count >= 4 && r.edge_count >= 6;
  return (facet || solid) && r.vertex_count <= kMaxPieceFeatures &&
         r.face_count <= kMaxPieceFeatures && r.edge_count <= kMaxPieceFeatures &&
         r.vertex_count + r.face_count == r.edge_count + 2 && r.loop_count == 2 * r.edge_count &&
         r.lane_count == padded_lanes(r.vertex_count);
}

RtStatus check_edges(const PieceView& p, double scale) noexcept {
  const double tolerance = check::kGeometryTolerance * scale;
  for (std::uint32_t e = 0; e < p.edge_count; ++e) {
    const EdgeRecord& edge = p.edges[e];
    for (int k = 0; k < 2; ++k) {
      if (edge.vertex[k] >= p.vertex_count || edge.face[k] >= p.face_count ||
          edge.apex[k] >= p.vertex_count) {
        return RtStatus::kBlobBadIndex;
      }
    }
    if (edge.vertex[0] >= edge.vertex[1] || edge.face[0] == edge.face[1])
      return RtStatus::kBlobBadTopology;
    if (e > 0) {
      const EdgeRecord& before = p.edges[e - 1];
      if (before.vertex[0] > edge.vertex[0] ||
          (before.vertex[0] == edge.vertex[0] && before.vertex[1] >= edge.vertex[1])) {
        return RtStatus::kBlobBadTopology;
      }
    }
    const EdgeDirection& d = p.edge_directions[e];
    const Double3 unit = check::to_double3(d.unit);
    const double length = static_cast<double>(d.length_m);
    if (!check::positive(length) ||
        !(check::absolute(dot(unit, unit) - 1.0) < check::kGeometryTolerance)) {
      return RtStatus::kBlobBadNumber;
    }
    const Double3 along = vertex_of(p, edge.vertex[1]) - vertex_of(p, edge.vertex[0]);
    const Double3 gap = along - Double3{length * unit.x, length * unit.y, length * unit.z};
    if (!(dot(gap, gap) <= tolerance * tolerance)) return RtStatus::kBlobBadNumber;
  }
  return RtStatus::kOk;
}

/// The loop of face `f` walks its edges counter-clockwise, and its vertices lie on its plane and
/// all others inside it.
RtStatus check_face(const PieceView& p, std::uint32_t f, double scale) noexcept {
  const auto vertices = p.face_vertices(f);
  const auto edges = p.face_edges(f);
  for (std::size_t k = 0; k < vertices.size(); ++k) {
    if (vertices[k] >= p.vertex_count || edges[k] >= p.edge_count) return RtStatus::kBlobBadIndex;
    const std::uint16_t u = vertices[k];
    const std::uint16_t v = vertices[k + 1 == vertices.size() ? 0 : k + 1];
    const EdgeRecord& edge = p.edges[edges[k]];
    const int side = edge.vertex[0] == u ? 0 : 1;
    if (edge.vertex[side] != u || edge.vertex[1 - side] != v || edge.face[side] != f)
      return RtStatus::kBlobBadTopology;
    for (std::size_t i = 0; i < k; ++i) {  // a loop that winds twice would pass every test below
      if (vertices[i] == u) return RtStatus::kBlobBadTopology;
    }
  }
  const PlaneRecord& plane = p.planes[p.faces[f].plane];
  const double sign = static_cast<double>(p.faces[f].sign);
  const Double3 n{sign * static_cast<double>(plane.normal[0]),
                  sign * static_cast<double>(plane.normal[1]),
                  sign * static_cast<double>(plane.normal[2])};
  const double offset = sign * static_cast<double>(plane.offset_m);
  const double tolerance = check::kGeometryTolerance * scale;
  for (std::uint32_t v = 0; v < p.vertex_count; ++v) {
    if (!(dot(n, vertex_of(p, v)) - offset <= tolerance)) return RtStatus::kBlobBadNumber;
  }
  for (const std::uint16_t v : vertices) {
    if (!(dot(n, vertex_of(p, v)) - offset >= -tolerance)) return RtStatus::kBlobBadNumber;
  }
  return RtStatus::kOk;
}

/// apex[k] is a vertex of face[k] at the largest distance from the edge's line (the first such
/// within rounding).
RtStatus check_apexes(const PieceView& p, double scale) noexcept {
  const double tolerance = check::kGeometryTolerance * scale;
  for (std::uint32_t e = 0; e < p.edge_count; ++e) {
    const EdgeRecord& edge = p.edges[e];
    const Double3 origin = vertex_of(p, edge.vertex[0]);
    const EdgeDirection& d = p.edge_directions[e];
    const Double3 unit = check::to_double3(d.unit);
    for (int k = 0; k < 2; ++k) {
      double largest = 0.0, at_apex = -1.0;
      for (const std::uint16_t v : p.face_vertices(edge.face[k])) {
        const Double3 c = cross(unit, vertex_of(p, v) - origin);
        const double distance = std::sqrt(dot(c, c));
        largest = std::max(largest, distance);
        if (v == edge.apex[k]) at_apex = distance;
      }
      if (at_apex < largest - 4.0 * tolerance) return RtStatus::kBlobBadTopology;
    }
  }
  return RtStatus::kOk;
}

RtStatus check_vertex_edges(const PieceView& p, std::uint64_t table_size) noexcept {
  const std::uint32_t least = is_flat(*p.record) ? 2 : 3;
  std::uint32_t total = 0;
  for (std::uint32_t v = 0; v < p.vertex_count; ++v) {
    const std::uint32_t begin = p.vertex_edge_begin[v], end = p.vertex_edge_begin[v + 1];
    if (begin > end || end > table_size || end - begin < least) return RtStatus::kBlobBadTopology;
    for (std::uint32_t i = begin; i < end; ++i) {
      const std::uint16_t e = p.vertex_edges[i];
      if (e >= p.edge_count) return RtStatus::kBlobBadIndex;
      if (i > begin && p.vertex_edges[i - 1] >= e) return RtStatus::kBlobBadTopology;
      if (p.edges[e].vertex[0] != v && p.edges[e].vertex[1] != v) return RtStatus::kBlobBadTopology;
    }
    total += end - begin;
  }
  return total == 2 * p.edge_count ? RtStatus::kOk : RtStatus::kBlobBadTopology;
}

/// Centre, radius and volume are those of the vertices and faces. The mean of rounded vertices is
/// off by one rounding of a vertex, and by that of a long sum in double: no more is allowed to the
/// centre, since the verdict relies on its lying inside pieces that may be thin.
RtStatus check_measures(const PieceView& p, double scale) noexcept {
  const PieceRecord& r = *p.record;
  constexpr double kLongSum = 64.0 * 256.0 * std::numeric_limits<double>::epsilon();
  const double tolerance = (check::kGeometryTolerance + kLongSum) * scale;
  Double3 sum{0.0, 0.0, 0.0};
  for (std::uint32_t v = 0; v < p.vertex_count; ++v) {
    const Double3 x = vertex_of(p, v);
    sum = {sum.x + x.x, sum.y + x.y, sum.z + x.z};
  }
  const double count = p.vertex_count;
  const Double3 centre{r.centre_m[0], r.centre_m[1], r.centre_m[2]};
  const Double3 gap{sum.x / count - centre.x, sum.y / count - centre.y, sum.z / count - centre.z};
  if (!(dot(gap, gap) <= tolerance * tolerance)) return RtStatus::kBlobBadNumber;
  double radius = 0.0;
  for (std::uint32_t v = 0; v < p.vertex_count; ++v) {
    const Double3 x = vertex_of(p, v) - centre;
    radius = std::max(radius, std::sqrt(dot(x, x)));
  }
  if (!check::finite(r.radius_m) || check::absolute(radius - r.radius_m) > tolerance)
    return RtStatus::kBlobBadNumber;
  double volume = 0.0;
  for (std::uint32_t f = 0; f < p.face_count; ++f) {
    const auto loop = p.face_vertices(f);
    const Double3 a = vertex_of(p, loop[0]) - centre;
    for (std::size_t k = 2; k < loop.size(); ++k) {
      volume +=
          dot(a, cross(vertex_of(p, loop[k - 1]) - centre, vertex_of(p, loop[k]) - centre)) / 6.0;
    }
  }
  // Every vertex may move by the tolerance: times the surface, at most that of a ball of the
  // radius.
  const double slack = 1e-6 * volume + 12.6 * tolerance * radius * radius;
  const bool bounds =
      is_flat(r) ? std::bit_cast<std::uint64_t>(r.volume_m3) == 0 : check::positive(r.volume_m3);
  if (!bounds || check::absolute(volume - r.volume_m3) > slack) return RtStatus::kBlobBadNumber;
  return RtStatus::kOk;
}

}  // namespace

RtStatus check::coupling(const CouplingParameters& c) noexcept {
  const bool stiffnesses =
      in_range(c.k_t_n_per_m, kMinStiffness_n_per_m, kMaxStiffness_n_per_m) &&
      in_range(c.k_r_nm_per_rad, c.k_t_n_per_m * kMinCouplingLength_m * kMinCouplingLength_m,
               c.k_t_n_per_m * kMaxSceneLength_m * kMaxSceneLength_m);
  const bool damping = in_range(c.damping_ns_per_m, 0.0, kMaxCouplingDamping_ns_per_m) &&
                       in_range(c.damping_share, 0.0, 1.0);
  const bool anchor = positive(c.max_rotation_error_rad) &&
                      c.max_rotation_error_rad <= kMaxRotationError_rad &&
                      in_range(c.max_translation_error_m, 0.0, kMaxSceneLength_m);
  const bool window = positive(c.max_window_s) && c.max_window_s <= kMaxWindow_s &&
                      in_range(c.min_window_s, 0.0, c.max_window_s);
  const bool rest = finite(c.max_pull_n) && c.max_pull_n >= 0.0 && finite(c.max_turn_nm) &&
                    c.max_turn_nm >= 0.0 && c.passivity <= 1 && c.allow_active <= 1 &&
                    c.passes >= 1 && c.passes <= kMaxProxyPasses &&
                    c.near_pairs <= kMostNearPairs &&
                    in_range(c.tolerance_m, 0.0, kMaxSceneLength_m) &&
                    in_range(c.climb_m, -kMaxSceneLength_m, kMaxSceneLength_m);
  return stiffnesses && damping && anchor && window && rest ? RtStatus::kOk
                                                            : RtStatus::kBlobBadNumber;
}

RtStatus check::device(const DeviceParameters& d) noexcept {
  if (d.given > 1 || d.reserved != 0) return RtStatus::kBlobBadNumber;
  for (const double x :
       {d.mass_kg, d.damping_ns_per_m, d.coulomb_friction_n, d.encoder_step_m, d.coulomb_torque_nm,
        d.encoder_step_rad, d.max_force_n, d.max_torque_nm, d.max_force_rate_n_per_s,
        d.max_torque_rate_nm_per_s, d.max_stiffness_n_per_m, d.max_damping_ns_per_m,
        d.max_rotary_stiffness_nm_per_rad, d.delay_s}) {
    if (!finite(x) || x < 0.0) return RtStatus::kBlobBadNumber;
  }
  for (int k = 0; k < 3; ++k) {
    const double j = d.rotor_inertia_kg_m2[k], b = d.rotor_damping_nms_per_rad[k];
    if (!finite(j) || j < 0.0 || !finite(b) || b < 0.0) return RtStatus::kBlobBadNumber;
    // An axis without inertia among others with one is an error of the table, not a light axis.
    if ((j > 0.0) != (d.rotor_inertia_kg_m2[0] > 0.0)) return RtStatus::kBlobBadNumber;
  }
  return RtStatus::kOk;
}

RtStatus check::held(const HeldPartParameters& h) noexcept {
  const double* const j = h.inertia_kg_m2;
  bool zero = true;
  for (int k = 0; k < 6; ++k) {
    if (!finite(j[k])) return RtStatus::kBlobBadNumber;
    zero = zero && !(absolute(j[k]) > 0.0);
  }
  for (int k = 0; k < 3; ++k) {
    if (!is_coordinate(h.centre_m[k]) ||
        !in_range(absolute(h.gravity_m_per_s2[k]), 0.0, kMaxGravity_m_per_s2)) {
      return RtStatus::kBlobBadNumber;
    }
    zero = zero && !(absolute(h.centre_m[k]) > 0.0) && !(absolute(h.gravity_m_per_s2[k]) > 0.0);
  }
  if (!in_range(h.mass_kg, 0.0, kMaxHeldMass_kg)) return RtStatus::kBlobBadNumber;
  if (!(h.mass_kg > 0.0)) return zero ? RtStatus::kOk : RtStatus::kBlobBadNumber;
  // Second moments S = integral of x x' dm = tr(J) / 2 - J, minus m c c': positive semidefinite.
  const double half = 0.5 * (j[0] + j[1] + j[2]);
  const double m = h.mass_kg;
  const double* const c = h.centre_m;
  const double xx = half - j[0] - m * c[0] * c[0], yy = half - j[1] - m * c[1] * c[1],
               zz = half - j[2] - m * c[2] * c[2], xy = -j[3] - m * c[0] * c[1],
               xz = -j[4] - m * c[0] * c[2], yz = -j[5] - m * c[1] * c[2];
  const double t = 1.0e-9 * half;
  const double minors[] = {(xx + t) * (yy + t) - xy * xy, (xx + t) * (zz + t) - xz * xz,
                           (yy + t) * (zz + t) - yz * yz};
  const double determinant =
      (xx + t) * minors[2] - xy * (xy * (zz + t) - yz * xz) + xz * (xy * yz - (yy + t) * xz);
  const bool body = half > 0.0 && finite(half) && xx + t > 0.0 && yy + t > 0.0 && zz + t > 0.0 &&
                    minors[0] >= 0.0 && minors[1] >= 0.0 && minors[2] >= 0.0 && determinant >= 0.0;
  return body ? RtStatus::kOk : RtStatus::kBlobBadNumber;
}

RtStatus check::envelope(const EnvelopeParameters& e) noexcept {
  constexpr double kPi = 3.141592653589794;  // rounded up
  if ((e.given & ~(kOrientationGiven | kWorkspaceGiven)) != 0 || e.reserved != 0)
    return RtStatus::kBlobBadNumber;
  double q2 = 0.0;
  bool q_zero = true;
  for (const double x : e.q_wa_xyzw) {
    q2 += x * x;
    q_zero = q_zero && is_zero(x);
  }
  const bool turned = (e.given & kOrientationGiven) != 0 ? in_range(q2, 1.0 - 1e-6, 1.0 + 1e-6) &&
                                                               in_range(e.max_angle_rad, 0.0, kPi)
                                                         : q_zero && is_zero(e.max_angle_rad);
  bool placed = true;
  const bool has_box = (e.given & kWorkspaceGiven) != 0;
  for (int k = 0; k < 3; ++k) {
    placed = placed && (has_box ? is_coordinate(e.min_m[k]) && is_coordinate(e.max_m[k]) &&
                                      e.min_m[k] < e.max_m[k]
                                : is_zero(e.min_m[k]) && is_zero(e.max_m[k]));
  }
  return turned && placed ? RtStatus::kOk : RtStatus::kBlobBadNumber;
}

RtStatus check::simplified(std::span<const SimplifiedBody> simplified,
                           std::span<const BodyRecord> bodies, std::uint32_t& index) noexcept {
  std::uint32_t least = 0;  // body that may come
  index = 0;
  for (const SimplifiedBody& s : simplified) {
    if (s.body < least || s.body >= bodies.size()) return RtStatus::kBlobBadIndex;
    const double volume_m3 = bodies[s.body].volume_m3;
    const bool change_fits = volume_m3 > 0.0
                                 ? finite(s.volume_change_m3) && s.volume_change_m3 < volume_m3
                                 : is_zero(s.volume_change_m3);
    if (s.reserved != 0 || !in_range(s.distance_m, 0.0, kMaxSceneLength_m) || !change_fits) {
      return RtStatus::kBlobBadNumber;
    }
    least = s.body + 1;
    ++index;
  }
  return RtStatus::kOk;
}

RtStatus check::guide(const GuideRecord& g) noexcept {
  for (const double x : {g.pull_n, g.hold_n, g.energy_j, g.ramp_s}) {
    if (!positive(x) || x > kMaxStiffness_n_per_m) return RtStatus::kBlobBadNumber;
  }
  for (const double x : {g.turn_m, g.near_goal_m, g.let_go_m}) {
    if (!positive(x) || x > kMaxSceneLength_m) return RtStatus::kBlobBadNumber;
  }
  return RtStatus::kOk;
}

RtStatus check::guide_stations(std::span<const GuideStation> stations, double turn_m,
                               std::uint32_t& index) noexcept {
  index = 0;
  if (stations.size() < 2 || stations.size() > kMostGuideStations) return RtStatus::kBlobBadCount;
  // A way is a difference of coordinates that were rounded, and so is a chord of turns.
  constexpr double kRounding = 64.0 * static_cast<double>(kRealEpsilon);
  for (; index < stations.size(); ++index) {
    const GuideStation& s = stations[index];
    double q2 = 0.0, way2 = 0.0, scale = turn_m;
    for (const Real x : s.q_wa_xyzw) q2 += static_cast<double>(x) * static_cast<double>(x);
    std::uint32_t planes = 0;
    for (const std::uint8_t kind : s.touching) planes += kind;
    if (!(absolute(q2 - 1.0) < kGeometryTolerance) || (s.contacts == 0) != (planes == 0)) {
      return RtStatus::kBlobBadNumber;
    }
    const bool last = index + 1 == stations.size();
    const Real* const q = s.q_wa_xyzw;
    const Real* const r = last ? q : stations[index + 1].q_wa_xyzw;
    const double turn = dot(to_double3(q), to_double3(r)) + static_cast<double>(q[3] * r[3]);
    const double twice = turn < 0.0 ? -2.0 * turn_m : 2.0 * turn_m;
    const Double3 chord =
        twice * (static_cast<double>(q[3]) * to_double3(r) -
                 static_cast<double>(r[3]) * to_double3(q) - cross(to_double3(r), to_double3(q)));
    const double turned[3] = {chord.x, chord.y, chord.z};
    for (int k = 0; k < 3; ++k) {
      const double x = static_cast<double>(s.x0_m[k]);
      const double next = last ? x : static_cast<double>(stations[index + 1].x0_m[k]);
      if (!is_coordinate(x) || !is_coordinate(next)) return RtStatus::kBlobBadNumber;
      scale = std::max({scale, absolute(x), absolute(next)});
      const double way = static_cast<double>(s.way_m[k]),
                   turns = static_cast<double>(s.turn_way_m[k]);
      if (!(absolute(way - (next - x)) <= kRounding * scale) ||
          !(absolute(turns - turned[k]) <= kRounding * scale)) {
        return RtStatus::kBlobBadNumber;
      }
      way2 += way * way + turns * turns;
    }
    const double inverse = static_cast<double>(s.per_square);
    const bool fits = last ? is_zero(inverse) : absolute(inverse * way2 - 1.0) <= 1.0e-3;
    const double cost = static_cast<double>(s.cost_m);
    const double next = last ? -1.0 : static_cast<double>(stations[index + 1].cost_m);
    const bool falls = last ? is_zero(cost) : in_range(cost, 0.0, kMaxSceneLength_m) && cost > next;
    if (!fits || !falls || !in_range(static_cast<double>(s.clearance_m), 0.0, kMaxSceneLength_m)) {
      return RtStatus::kBlobBadNumber;
    }
  }
  return RtStatus::kOk;
}

RtStatus check::unit_directions(std::span<const Real> directions, std::uint32_t& index) noexcept {
  for (index = 0; index < directions.size() / 3; ++index) {
    const Double3 d = to_double3(&directions[3 * std::size_t{index}]);
    if (!(absolute(dot(d, d) - 1.0) < kGeometryTolerance)) return RtStatus::kBlobBadNumber;
  }
  return RtStatus::kOk;
}

RtStatus SceneView::check_bodies(SceneFault& fault) const noexcept {
  if (bodies_.size() < 2 || tables_.pieces.size() > kMostPieces) return RtStatus::kBlobBadCount;
  std::uint64_t pieces = 0, planes = 0;
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    fault.index = static_cast<std::uint32_t>(b);
    const BodyRecord& body = bodies_[b];
    if (body.piece_begin != pieces || body.plane_begin != planes || body.piece_count == 0)
      return RtStatus::kBlobBadCount;
    pieces += body.piece_count;
    planes += body.plane_count;
    if (pieces > tables_.pieces.size() || planes > tables_.planes.size())
      return RtStatus::kBlobBadCount;
    if (!check::within(body.name_offset, body.name_bytes, text_.size()))
      return RtStatus::kBlobBadIndex;
    double volume = 0.0;
    for (std::uint32_t i = 0; i < body.piece_count; ++i) {
      if (tables_.pieces[body.piece_begin + i].body != b) return RtStatus::kBlobBadIndex;
      volume += tables_.pieces[body.piece_begin + i].volume_m3;
    }
    for (const double x : body.reference_m) {
      if (!check::is_coordinate(x)) return RtStatus::kBlobBadNumber;
    }
    const double most = b == 0 ? 0.0 : kMaxFriction;
    if (!in_range(body.friction, 0.0, most) ||
        !in_range(body.friction_static, body.friction, most)) {
      return RtStatus::kBlobBadNumber;
    }
    if (!check::finite(body.volume_m3) ||
        !(check::absolute(volume - body.volume_m3) <= 1e-6 * volume)) {
      return RtStatus::kBlobBadNumber;
    }
    for (std::uint32_t i = 0; i < body.plane_count; ++i) {
      const PlaneRecord& plane = tables_.planes[body.plane_begin + i];
      double n2 = 0.0;
      for (const Real x : plane.normal) n2 += static_cast<double>(x) * static_cast<double>(x);
      if (!(check::absolute(n2 - 1.0) < check::kGeometryTolerance) ||
          !check::finite(plane.offset_m)) {
        return RtStatus::kBlobBadNumber;
      }
    }
  }
  return pieces == tables_.pieces.size() && planes == tables_.planes.size()
             ? RtStatus::kOk
             : RtStatus::kBlobBadCount;
}

/// A facet has a cone for each vertex and edge, behind those of the facets before; other pieces
/// have none. Facets may share directions.
RtStatus SceneView::check_cones(std::uint32_t index, std::uint64_t& ranges) const noexcept {
  const PieceRecord& r = tables_.pieces[index];
  if (!is_flat(r)) return r.cone_begin == kNoCones ? RtStatus::kOk : RtStatus::kBlobBadIndex;
  if (r.cone_begin != ranges) return RtStatus::kBlobBadIndex;
  ranges += std::uint64_t{r.vertex_count} + r.edge_count;
  if (ranges > tables_.cone_ranges.size()) return RtStatus::kBlobBadCount;
  for (std::uint64_t i = r.cone_begin; i < ranges; ++i) {
    const ConeRange& cone = tables_.cone_ranges[static_cast<std::size_t>(i)];
    if (!check::within(cone.begin, cone.count, tables_.cone_directions.size() / 3))
      return RtStatus::kBlobBadIndex;
  }
  return RtStatus::kOk;
}

RtStatus SceneView::check_piece(std::uint32_t index) const noexcept {
  const PieceRecord& r = tables_.pieces[index];
  if (!counts_fit(r)) return RtStatus::kBlobBadCount;
  const bool first = index == 0;
  const PieceRecord& before = tables_.pieces[first ? 0 : index - 1];
  if (r.vertex_begin != (first ? 0 : before.vertex_begin + before.vertex_count) ||
      r.face_begin != (first ? 0 : before.face_begin + before.face_count) ||
      r.edge_begin != (first ? 0 : before.edge_begin + before.edge_count) ||
      r.loop_begin != (first ? 0 : before.loop_begin + before.loop_count) ||
      r.lane_begin != (first ? 0 : before.lane_begin + stored_lanes(before)) ||
      r.flat_edges != (first ? 0 : before.flat_edges + (is_flat(before) ? before.edge_count : 0))) {
    return RtStatus::kBlobBadCount;
  }
  const bool last = index + 1 == tables_.pieces.size();
  const std::uint64_t vertices_end = std::uint64_t{r.vertex_begin} + r.vertex_count;
  const std::uint64_t faces_end = std::uint64_t{r.face_begin} + r.face_count;
  const std::uint64_t edges_end = std::uint64_t{r.edge_begin} + r.edge_count;
  const std::uint64_t loops_end = std::uint64_t{r.loop_begin} + r.loop_count;
  const std::uint64_t lanes_end = std::uint64_t{r.lane_begin} + stored_lanes(r);
  const std::uint64_t sides_end = std::uint64_t{r.flat_edges} + (is_flat(r) ? r.edge_count : 0);
  const std::uint64_t arcs_end = edges_end - sides_end;
  const bool fits =
      vertices_end <= tables_.vertices.size() / 3 && faces_end <= tables_.faces.size() &&
      edges_end <= tables_.edges.size() && edges_end <= tables_.edge_directions.size() &&
      loops_end <= tables_.loop_vertices.size() && loops_end <= tables_.loop_edges.size() &&
      vertices_end < tables_.vertex_edge_begin.size() &&
      vertices_end <= tables_.source_vertices.size() && lanes_end <= tables_.lanes.size() &&
      arcs_end <= tables_.arcs.size() && sides_end <= tables_.cone_directions.size() / 3;
  const bool exact =
      vertices_end == tables_.vertices.size() / 3 && faces_end == tables_.faces.size() &&
      edges_end == tables_.edges.size() && edges_end == tables_.edge_directions.size() &&
      loops_end == tables_.loop_vertices.size() && loops_end == tables_.loop_edges.size() &&
      vertices_end + 1 == tables_.vertex_edge_begin.size() &&
      vertices_end == tables_.source_vertices.size() && lanes_end == tables_.lanes.size() &&
      arcs_end == tables_.arcs.size() &&
      tables_.vertex_edge_begin[static_cast<std::size_t>(vertices_end)] ==
          tables_.vertex_edges.size();
  if (!fits || (last && !exact)) return RtStatus::kBlobBadCount;
  const PieceView p = piece(index);
  if (p.vertex_edge_begin[0] != (first ? 0 : 2 * std::uint64_t{r.edge_begin}))
    return RtStatus::kBlobBadIndex;
  const double scale = coordinate_scale(p);
  if (!check::positive(scale)) return RtStatus::kBlobBadNumber;
  RtStatus status = check_edges(p, scale);
  if (status != RtStatus::kOk) return status;
  std::uint64_t loop_end = r.loop_begin;
  for (std::uint32_t f = 0; f < p.face_count; ++f) {
    const FaceRecord& face = p.faces[f];
    if (face.plane >= bodies_[r.body].plane_count) return RtStatus::kBlobBadIndex;
    if ((face.sign != 1 && face.sign != -1) || face.source_face < -1)
      return RtStatus::kBlobBadNumber;
    if (face.loop_begin != loop_end || face.loop_count < 3) return RtStatus::kBlobBadTopology;
    if (face.loop_count > kMaxFaceVertices) return RtStatus::kBlobBadCount;
    loop_end += face.loop_count;
    if (loop_end > loops_end) return RtStatus::kBlobBadTopology;
    status = check_face(p, f, scale);
    if (status != RtStatus::kOk) return status;
  }
  if (loop_end != loops_end) return RtStatus::kBlobBadTopology;
  for (std::uint32_t v = 0; v < p.vertex_count; ++v) {
    if (p.source_vertices[v] < -1) return RtStatus::kBlobBadNumber;
  }
  status = check_apexes(p, scale);
  if (status != RtStatus::kOk) return status;
  status = check_vertex_edges(p, tables_.vertex_edges.size());
  if (status != RtStatus::kOk) return status;
  status = check_measures(p, scale);
  if (status != RtStatus::kOk) return status;
  if (is_flat(r)) {
    status = check::sides(p);
  } else {
    status = check::lanes(p);
    if (status != RtStatus::kOk) return status;
    status = check::arcs(p, scale, parameters_->epsilon_m);
  }
  return status == RtStatus::kOk ? check::bounds(p, scale, parameters_->epsilon_m) : status;
}

}  // namespace haptic
