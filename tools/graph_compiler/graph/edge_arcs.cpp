// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/graph/edge_arcs.hpp"

#include <algorithm>

#include "rt_core/scene/derived_check.hpp"

namespace haptic::tools {
namespace {

/// Added to every half angle [rad]: some twenty roundings of a unit vector's coordinate.
constexpr Wide kMargin_rad = HAPTIC_REAL_IS_FLOAT ? 2.0e-6L : 4.0e-15L;

/// An angle as its cosine and sine; sums without trigonometry, so that the bits are defined.
struct Turn {
  Wide cosine = 1, sine = 0;

  friend Turn operator+(const Turn& a, const Turn& b) {
    return {a.cosine * b.cosine - a.sine * b.sine, a.sine * b.cosine + a.cosine * b.sine};
  }
  friend Turn operator-(const Turn& a) { return {a.cosine, -a.sine}; }
};

/// Half of a turn in [0, pi / 2].
Turn half(const Turn& a) {
  const Wide cosine = std::sqrt((1 + a.cosine) / 2);
  return {cosine, a.sine / (2 * cosine)};
}

/// Turn beyond the face's normal at which an apex at distance `width_m` > epsilon rises by epsilon.
Turn extension(Wide width_m, Wide epsilon_m) {
  const Wide sine = epsilon_m / width_m;
  return {std::sqrt((1 - sine) * (1 + sine)), sine};
}

Real to_real(Wide x) { return static_cast<Real>(x) + Real{0}; }

/// Largest Real not above x in [-1, 1]: the cosine of a flat arc must not shrink it.
Real to_real_below(Wide x) {
  const Real nearest = to_real(x);
  return static_cast<Wide>(nearest) > x ? std::nextafter(nearest, Real{-1}) : nearest;
}

}  // namespace

WidePiece::WidePiece(const PieceTopology& piece_topology, const BodyGeometry& geometry,
                     std::size_t piece)
    : topology(&piece_topology) {
  for (const auto& v : geometry.pieces[piece].vertices) vertices.push_back(widen(v));
  for (const FaceRecord& face : piece_topology.faces) {
    const Wide3 n = widen(geometry.planes[face.plane].normal);
    normals.push_back(static_cast<Wide>(face.sign) * n);
  }
  for (const EdgeDirection& d : geometry.pieces[piece].edge_directions) {
    along.push_back(unit(widen(d.unit)));
  }
}

WideArc wide_arc(const WidePiece& piece, std::uint32_t e, double epsilon_m) {
  const EdgeRecord& edge = piece.topology->edges[e];
  const Wide3& along = piece.along[e];
  WideArc arc{};
  Wide3 normal[2];
  Turn beyond[2];
  for (int k = 0; k < 2; ++k) {
    const Wide3& n = piece.normals[edge.face[k]];
    normal[k] = unit(n - dot(n, along) * along);
    const Wide3 apex = piece.vertices[edge.apex[k]] - piece.vertices[edge.vertex[0]];
    arc.width_m[k] = norm(cross(along, apex));
    arc.full = arc.full || !(static_cast<Wide>(epsilon_m) < arc.width_m[k]);
    if (!arc.full) beyond[k] = half(extension(arc.width_m[k], static_cast<Wide>(epsilon_m)));
  }
  // The normal turns about the edge's direction from face[0] to face[1]. Of sum and difference of
  // the two normals the longer one says where the middle is.
  const Wide3 sum = normal[0] + normal[1], difference = normal[1] - normal[0];
  const bool flat = dot(sum, sum) > dot(difference, difference);
  const Wide3 middle = flat ? unit(sum) : cross(unit(difference), along);
  const Wide3 across = cross(along, middle);
  const Turn half_angle{norm(sum) / 2, norm(difference) / 2};
  const Turn shift = arc.full ? Turn{} : beyond[1] + -beyond[0];
  arc.mid = unit(shift.cosine * middle + shift.sine * across);
  arc.side = cross(along, arc.mid);
  const Turn margin{1 - kMargin_rad * kMargin_rad / 2, kMargin_rad};
  Turn total = half_angle + beyond[0] + beyond[1] + margin;
  if (arc.full || total.sine < 0) total = {-1, 0};
  const Wide length = std::sqrt(total.cosine * total.cosine + total.sine * total.sine);
  arc.cosine = total.cosine / length;
  arc.sine = total.sine / length;
  return arc;
}

/// True if no vertex rises higher than epsilon, the height of the apex, at the arc's end beyond
/// face[k]. The ratio of both heights rises towards the end.
static bool apex_rules(const WidePiece& piece, const WideArc& arc, std::uint32_t e, int k,
                       double epsilon_m) {
  if (arc.full) return false;
  const Wide3 n = arc.end(k);
  const Wide3& origin = piece.vertices[piece.topology->edges[e].vertex[0]];
  const Wide limit = static_cast<Wide>(epsilon_m) * (1 + static_cast<Wide>(check::kApexSlack));
  for (const Wide3& v : piece.vertices) {
    if (dot(n, v - origin) > limit) return false;
  }
  return true;
}

std::vector<EdgeArc> edge_arcs(const WidePiece& piece, const std::vector<WideArc>& arcs,
                               double epsilon_m) {
  std::vector<EdgeArc> result;
  for (std::uint32_t e = 0; e < arcs.size(); ++e) {
    const WideArc& arc = arcs[e];
    EdgeArc record{};
    for (std::size_t i = 0; i < 3; ++i) {
      record.mid[i] = to_real(arc.mid[i]);
      record.side[i] = to_real(arc.side[i]);
      for (std::size_t k = 0; k < 2; ++k) {
        const Wide3& n = piece.normals[piece.topology->edges[e].face[k]];
        record.tilt[k][i] = to_real(arc.width_m[k] * n[i]);
      }
    }
    for (int k = 0; k < 2; ++k) {
      record.apex_rules[k] = apex_rules(piece, arc, e, k, epsilon_m) ? Real{1} : Real{0};
    }
    record.cosine = to_real_below(arc.cosine);
    record.sine = to_real(arc.sine);
    result.push_back(record);
  }
  return result;
}

std::vector<std::array<Real, 3>> arc_middles(const std::vector<WideArc>& arcs) {
  std::vector<std::array<Real, 3>> middles;
  for (const WideArc& arc : arcs)
    middles.push_back({to_real(arc.mid[0]), to_real(arc.mid[1]), to_real(arc.mid[2])});
  return middles;
}

}  // namespace haptic::tools
