// SPDX-License-Identifier: Apache-2.0
#include "rt_core/scene/derived_check.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace haptic::check {
namespace {

/// Rounding of directions and of products of a few of them.
constexpr double kUnitTolerance = kGeometryTolerance;

/// Largest relaxation ratio: fits a float with room for products.
constexpr double kMaxRatio = 1.0e30;

bool near_zero(double x) noexcept { return absolute(x) <= kUnitTolerance; }

double norm(const Double3& a) noexcept { return std::sqrt(dot(a, a)); }

/// Outward unit normal of face `f` without what rounding left of it along the edge.
Double3 normal_across(const PieceView& p, std::uint32_t f, const Double3& along) noexcept {
  const Vec3 n = p.face_normal(f);
  const Double3 outward = to_double3(n.data());
  const Double3 across = outward - dot(outward, along) * along;
  return (1.0 / norm(across)) * across;
}

/// Distance of apex[k] of edge `e` from its line.
double width_of(const PieceView& p, std::uint32_t e, int k, const Double3& along) noexcept {
  const EdgeRecord& edge = p.edges[e];
  return norm(cross(along, vertex_of(p, edge.apex[k]) - vertex_of(p, edge.vertex[0])));
}

/// Side k of the arc ends where it must: the turn from the face's normal to the end is at most a
/// right angle, away from the arc's middle, and its sine lifts the apex by epsilon. Of a full arc
/// only the tilt is asked.
bool end_fits(const PieceView& p, std::uint32_t e, int k, const Double3& along, double scale,
              double epsilon_m, bool full) noexcept {
  const EdgeRecord& edge = p.edges[e];
  const EdgeArc& arc = p.arcs[e];
  const Double3 mid = to_double3(arc.mid), side = to_double3(arc.side);
  const double outwards = k == 0 ? -1.0 : 1.0;
  const Double3 end =
      static_cast<double>(arc.cosine) * mid + (outwards * static_cast<double>(arc.sine)) * side;
  const Double3 n = normal_across(p, edge.face[k], along);
  const double width = width_of(p, e, k, along);

  // The turn is about the edge, from face[0] to face[1]: cross(mid, side).
  const double sine = outwards * dot(cross(n, end), cross(mid, side));
  const double needed = epsilon_m < width ? epsilon_m / width : 1.0;
  const double rounding = kUnitTolerance + kGeometryTolerance * scale * needed / width;
  const bool ends = absolute(sine - needed) <= rounding && dot(n, end) >= -1.0e-3;
  if (!full && !ends) return false;

  // Each coordinate is a product: right to a share of itself.
  const Vec3 outward = p.face_normal(edge.face[k]);
  const double share = kUnitTolerance + kGeometryTolerance * scale / width;
  for (int i = 0; i < 3; ++i) {
    const double product = width * static_cast<double>(outward[i]);
    const double gap = absolute(static_cast<double>(arc.tilt[k][i]) - product);
    if (!(gap <= share * absolute(product))) return false;
  }
  return true;
}

/// The record's reach is the largest distance of a vertex from the origin.
bool reach_fits(const PieceView& p, double scale) noexcept {
  double reach = 0.0;
  for (std::uint32_t v = 0; v < p.vertex_count; ++v) {
    reach = std::max(reach, norm(vertex_of(p, v)));
  }
  const double stated = p.record->reach_m;
  return finite(stated) && absolute(stated - reach) <= kGeometryTolerance * scale;
}

}  // namespace

RtStatus lanes(const PieceView& p) noexcept {
  for (std::uint32_t v = 0; v < p.lane_count; ++v) {
    const Real* vertex = p.vertices + 3 * std::size_t{v < p.vertex_count ? v : 0};
    for (std::size_t k = 0; k < 3; ++k) {
      // Bytes, not values: -0 in place of +0 would make the core's answers depend on the table.
      if (std::memcmp(p.lanes + k * p.lane_count + v, vertex + k, sizeof(Real)) != 0)
        return RtStatus::kBlobBadNumber;
    }
  }
  return RtStatus::kOk;
}

/// `apex_rules` is 0 or 1, as bytes, and 1 only where no vertex rises by more than epsilon at the
/// arc's end.
bool apex_rule_fits(const PieceView& p, std::uint32_t e, int k, double scale,
                    double epsilon_m) noexcept {
  const EdgeArc& arc = p.arcs[e];
  constexpr Real kNo = 0, kYes = 1;
  if (std::memcmp(&arc.apex_rules[k], &kNo, sizeof kNo) == 0) return true;
  if (std::memcmp(&arc.apex_rules[k], &kYes, sizeof kYes) != 0) return false;
  const Double3 mid = to_double3(arc.mid), side = to_double3(arc.side);
  const double sine = static_cast<double>(k == 0 ? -arc.sine : arc.sine);
  const Double3 n = static_cast<double>(arc.cosine) * mid + sine * side;
  const Double3 origin = vertex_of(p, p.edges[e].vertex[0]);
  for (std::uint32_t v = 0; v < p.vertex_count; ++v) {
    const Double3 vertex = vertex_of(p, static_cast<std::uint16_t>(v));
    const double highest = epsilon_m * (1 + kApexSlack + kUnitTolerance);
    if (dot(n, vertex - origin) > highest + kGeometryTolerance * scale) return false;
  }
  return true;
}

RtStatus arcs(const PieceView& p, double scale, double epsilon_m) noexcept {
  for (std::uint32_t e = 0; e < p.edge_count; ++e) {
    const EdgeArc& arc = p.arcs[e];
    const Double3 unit = to_double3(p.edge_directions[e].unit);
    const Double3 along = (1.0 / norm(unit)) * unit;
    const Double3 mid = to_double3(arc.mid), side = to_double3(arc.side);
    const double cosine = static_cast<double>(arc.cosine), sine = static_cast<double>(arc.sine);
    const bool frame = near_zero(dot(mid, mid) - 1.0) && near_zero(dot(side, side) - 1.0) &&
                       near_zero(dot(mid, side)) && near_zero(dot(mid, along)) &&
                       near_zero(dot(side, along)) &&
                       near_zero(cosine * cosine + sine * sine - 1.0) && sine >= 0.0;
    if (!frame) return RtStatus::kBlobBadNumber;
    // A face that is no wider than epsilon never rises by it: the arc is the whole circle.
    const double width = std::min(width_of(p, e, 0, along), width_of(p, e, 1, along));
    const bool full = arc.cosine == -1 && arc.sine == 0;
    const double share = kUnitTolerance + kGeometryTolerance * scale / width;
    if (full ? !(width <= epsilon_m * (1.0 + share)) : !(width >= epsilon_m * (1.0 - share)))
      return RtStatus::kBlobBadNumber;
    for (int k = 0; k < 2; ++k) {
      if (!apex_rule_fits(p, e, k, scale, epsilon_m)) return RtStatus::kBlobBadNumber;
      const Double3 n = normal_across(p, p.edges[e].face[k], along);
      const bool inside = dot(n, mid) >= cosine - kUnitTolerance;
      if (!inside || !end_fits(p, e, k, along, scale, epsilon_m, full))
        return RtStatus::kBlobBadNumber;
    }
  }
  return RtStatus::kOk;
}

RtStatus sides(const PieceView& p) noexcept {
  for (std::uint32_t e = 0; e < p.edge_count; ++e) {
    const EdgeRecord& edge = p.edges[e];
    const Double3 unit = to_double3(p.edge_directions[e].unit);
    const Double3 along = (1.0 / norm(unit)) * unit;
    const Double3 side = to_double3(p.side_normal(e).data());
    const Double3 across = normal_across(p, edge.face[0], along);
    const Double3 apex = vertex_of(p, edge.apex[0]) - vertex_of(p, edge.vertex[0]);
    const bool fits = near_zero(dot(side, side) - 1.0) && near_zero(dot(side, along)) &&
                      near_zero(dot(side, across)) && dot(side, apex) < 0.0;
    if (!fits) return RtStatus::kBlobBadNumber;
  }
  return RtStatus::kOk;
}

RtStatus bounds(const PieceView& p, double scale, double epsilon_m) noexcept {
  const PieceRecord& r = *p.record;
  const double tolerance = kGeometryTolerance * scale;
  // No support lies farther behind a plane through a vertex than the piece is wide.
  const double widest = epsilon_m + 2.0 * r.radius_m;
  const bool vertex_fits = finite(r.vertex_relax_m) && r.vertex_relax_m >= epsilon_m &&
                           r.vertex_relax_m <= widest * (1.0 + 1.0e-6) + tolerance;
  const bool edge_fits = r.edge_relax_ratio >= 1.0 && r.edge_relax_ratio <= kMaxRatio;
  return reach_fits(p, scale) && vertex_fits && edge_fits ? RtStatus::kOk
                                                          : RtStatus::kBlobBadNumber;
}

}  // namespace haptic::check
