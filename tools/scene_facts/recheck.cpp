// SPDX-License-Identifier: Apache-2.0
// Points 1 and 3 of the certificate (tools/graph_compiler/METHOD.md section 7) once more, from the
// bytes of the scene alone.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "rt_core/scene/scene_check.hpp"
#include "tools/scene_facts/scene_facts.hpp"

namespace haptic::tools {
namespace {

/// Heights of the vertices of `piece` over face `f` of `owner`, outward positive [m].
struct Heights {
  double smallest = std::numeric_limits<double>::infinity();
  double largest = -std::numeric_limits<double>::infinity();
};
Heights heights(const PieceView& owner, std::uint32_t f, const PieceView& piece) {
  const PlaneRecord& plane = owner.planes[owner.faces[f].plane];
  Heights result;
  for (std::uint32_t v = 0; v < piece.vertex_count; ++v) {
    const Real* x = piece.vertices + 3 * std::size_t{v};
    double height = -static_cast<double>(plane.offset_m);
    for (int k = 0; k < 3; ++k) {
      height += static_cast<double>(plane.normal[k]) * static_cast<double>(x[k]);
    }
    result.smallest = std::min(result.smallest, owner.faces[f].sign * height);
    result.largest = std::max(result.largest, owner.faces[f].sign * height);
  }
  return result;
}

bool separates(const PieceView& owner, const PieceView& other, double tolerance) {
  for (std::uint32_t f = 0; f < owner.face_count; ++f) {
    if (heights(owner, f, other).smallest >= -tolerance) return true;
  }
  return false;
}

struct Extent {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
};
Extent extent_along(const PieceView& piece, const check::Double3& axis) {
  Extent extent;
  for (std::uint32_t v = 0; v < piece.vertex_count; ++v) {
    const double at = dot(check::vertex_of(piece, v), axis);
    extent.low = std::min(extent.low, at);
    extent.high = std::max(extent.high, at);
  }
  return extent;
}

check::Double3 edge_vector(const PieceView& piece, std::uint32_t e) {
  const EdgeRecord& edge = piece.edges[e];
  return check::vertex_of(piece, edge.vertex[1]) - check::vertex_of(piece, edge.vertex[0]);
}

/// A plane along an edge of each lies between the two, as between crossed beams.
bool separated_by_edges(const PieceView& a, const PieceView& b, double tolerance) {
  for (std::uint32_t e = 0; e < a.edge_count; ++e) {
    for (std::uint32_t f = 0; f < b.edge_count; ++f) {
      const check::Double3 axis = cross(edge_vector(a, e), edge_vector(b, f));
      const double length = std::sqrt(dot(axis, axis));
      if (!(length > 0.0)) continue;
      const check::Double3 unit = (1.0 / length) * axis;
      const Extent of_a = extent_along(a, unit), of_b = extent_along(b, unit);
      if (of_a.high <= of_b.low + tolerance || of_b.high <= of_a.low + tolerance) return true;
    }
  }
  return false;
}

/// Spheres about the pieces that do not meet: separated without looking at planes.
bool far_apart(const PieceView& a, const PieceView& b) {
  double square = 0.0;
  for (int k = 0; k < 3; ++k) {
    const double d = a.record->centre_m[k] - b.record->centre_m[k];
    square += d * d;
  }
  return std::sqrt(square) > a.record->radius_m + b.record->radius_m;
}

/// A vertex of the user's mesh is one point: it has the same coordinates in every piece and comes
/// once in each.
std::uint64_t source_conflicts(const SceneView& view, const BodyRecord& body) {
  std::map<std::int32_t, std::array<Real, 3>> where;
  std::uint64_t conflicts = 0;
  for (std::uint32_t i = 0; i < body.piece_count; ++i) {
    const PieceView piece = view.piece(body.piece_begin + i);
    std::set<std::int32_t> in_piece;
    for (std::uint32_t v = 0; v < piece.vertex_count; ++v) {
      const std::int32_t id = piece.source_vertices[v];
      if (id < 0) continue;
      const Real* x = piece.vertices + 3 * std::size_t{v};
      const std::array<Real, 3> point{x[0], x[1], x[2]};
      const bool first = in_piece.insert(id).second;
      if (!first || where.emplace(id, point).first->second != point) ++conflicts;
    }
  }
  return conflicts;
}

/// Volume of a piece as cones over its faces, from its middle.
double volume_of(const PieceView& piece) {
  const check::Double3 apex{piece.record->centre_m[0], piece.record->centre_m[1],
                            piece.record->centre_m[2]};
  double six_volumes = 0.0;
  for (std::uint32_t f = 0; f < piece.face_count; ++f) {
    const auto loop = piece.face_vertices(f);
    const check::Double3 first = check::vertex_of(piece, loop[0]) - apex;
    for (std::size_t k = 1; k + 1 < loop.size(); ++k) {
      six_volumes += dot(first, cross(check::vertex_of(piece, loop[k]) - apex,
                                      check::vertex_of(piece, loop[k + 1]) - apex));
    }
  }
  return six_volumes / 6.0;
}

double body_size(const SceneView& view, const BodyRecord& body) {
  double low[3] = {1e300, 1e300, 1e300}, high[3] = {-1e300, -1e300, -1e300};
  for (std::uint32_t i = 0; i < body.piece_count; ++i) {
    const PieceView piece = view.piece(body.piece_begin + i);
    for (std::size_t j = 0; j < 3 * std::size_t{piece.vertex_count}; ++j) {
      const double x = static_cast<double>(piece.vertices[j]);
      low[j % 3] = std::min(low[j % 3], x);
      high[j % 3] = std::max(high[j % 3], x);
    }
  }
  double size = 0.0;
  for (int k = 0; k < 3; ++k) {
    // A grip far outside the part makes its coordinates, hence their rounding, larger than the
    // part.
    size = std::max({size, high[k] - low[k], std::abs(low[k]), std::abs(high[k])});
  }
  return size;
}

}  // namespace

double body_tolerance(const SceneView& view, std::uint32_t body) {
  return body_size(view, view.bodies()[body]) * std::max(1e-12, check::kGeometryTolerance);
}

BodyRecheck recheck_body(const SceneView& view, std::uint32_t index) {
  const BodyRecord& body = view.bodies()[index];
  BodyRecheck result;
  result.tolerance_m = body_tolerance(view, index);
  for (std::uint32_t i = 0; i < body.piece_count; ++i) {
    const PieceView piece = view.piece(body.piece_begin + i);
    result.volume_m3 += volume_of(piece);
    for (std::uint32_t f = 0; f < piece.face_count; ++f) {
      result.largest_outside_m =
          std::max(result.largest_outside_m, heights(piece, f, piece).largest);
      for (const std::uint16_t v : piece.face_vertices(f)) {
        const Vec3 n = piece.face_normal(f);
        const double height = static_cast<double>(n.dot(piece.vertex(v)) - piece.face_offset(f));
        result.largest_off_m = std::max(result.largest_off_m, std::abs(height));
      }
    }
    // Facets of a surface share their edges and may cross: nothing is claimed of pairs of them.
    if (piece.is_facet()) continue;
    for (std::uint32_t j = i + 1; j < body.piece_count; ++j) {
      const PieceView other = view.piece(body.piece_begin + j);
      result.piece_pairs += 1;
      if (far_apart(piece, other) || separates(piece, other, result.tolerance_m) ||
          separates(other, piece, result.tolerance_m) ||
          separated_by_edges(piece, other, result.tolerance_m)) {
        result.separated_pairs += 1;
      }
    }
  }
  result.source_conflicts = source_conflicts(view, body);
  result.convex =
      result.largest_outside_m <= result.tolerance_m && result.largest_off_m <= result.tolerance_m;
  return result;
}

}  // namespace haptic::tools
