// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/graph/body_geometry.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "rt_core/scene/scene_check.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/graph/wide3.hpp"

namespace haptic::tools {
namespace {

using WideMatrix = std::array<Wide3, 3>;

Wide3 product(const WideMatrix& m, const Wide3& v) {
  return {dot(m[0], v), dot(m[1], v), dot(m[2], v)};
}

constexpr WideMatrix kIdentity{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};

WideMatrix rotation_matrix(const std::array<Wide, 4>& q) {
  const Wide w = q[0], x = q[1], y = q[2], z = q[3];
  return {{{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
           {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
           {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}}};
}

/// Nearest Real; a zero is always +0, so that equal geometry has equal bytes.
Real round_to_real(Wide x) { return static_cast<Real>(x) + Real{0}; }
double round_to_double(Wide x) { return static_cast<double>(x) + 0.0; }

PieceGeometry piece_geometry(const ConvexPiece& piece, const PieceTopology& topology,
                             const WideMatrix& r, const Wide3& shift) {
  PieceGeometry g;
  std::vector<Wide3> exact;
  Wide3 sum{0, 0, 0};
  for (const auto& v : piece.vertices) {
    const Wide3 x = product(r, widen(v)) + shift;
    exact.push_back(x);
    sum = sum + x;
    g.vertices.push_back({round_to_real(x[0]), round_to_real(x[1]), round_to_real(x[2])});
  }
  const Wide count = static_cast<Wide>(exact.size());
  const Wide3 centre{sum[0] / count, sum[1] / count, sum[2] / count};
  Wide radius_squared = 0;
  for (const Wide3& x : exact) {
    radius_squared = std::max(radius_squared, dot(x - centre, x - centre));
  }
  g.radius_m = round_to_double(std::sqrt(radius_squared));
  for (std::size_t k = 0; k < 3; ++k) g.centre_m[k] = round_to_double(centre[k]);
  for (const EdgeRecord& edge : topology.edges) {
    const Wide3 along = exact[edge.vertex[1]] - exact[edge.vertex[0]];
    const Wide length = std::sqrt(dot(along, along));
    EdgeDirection d{};
    for (std::size_t k = 0; k < 3; ++k) d.unit[k] = round_to_real(along[k] / length);
    d.length_m = round_to_real(length);
    g.edge_directions.push_back(d);
  }
  if (piece.is_facet()) {
    g.volume_m3 = 0.0;
  } else if (piece.volume_m3 > 0.0) {
    g.volume_m3 = piece.volume_m3;  // exact before its rounding, where the decomposition made it
  } else {
    Wide volume = 0;
    for (const PieceFace& face : piece.faces) {
      const Wide3 a = exact[face.loop[0]] - centre;
      for (std::size_t k = 2; k < face.loop.size(); ++k) {
        volume += dot(a, cross(exact[face.loop[k - 1]] - centre, exact[face.loop[k]] - centre));
      }
    }
    g.volume_m3 = round_to_double(volume / 6);
  }
  return g;
}

/// Every point x of the body goes to r x + shift.
BodyGeometry place_body(const Body& body, const std::vector<PieceTopology>& topologies,
                        const WideMatrix& r, const Wide3& shift) {
  BodyGeometry g;
  for (const BodyPlane& plane : body.planes) {
    const Wide3 n = product(r, widen(plane.normal));
    PlaneRecord record{};
    for (std::size_t k = 0; k < 3; ++k) record.normal[k] = round_to_real(n[k]);
    record.offset_m = round_to_real(static_cast<Wide>(plane.offset_m) + dot(n, shift));
    g.planes.push_back(record);
  }
  for (std::size_t i = 0; i < body.pieces.size(); ++i) {
    g.pieces.push_back(piece_geometry(body.pieces[i], topologies[i], r, shift));
  }
  for (const auto& direction : body.directions) {
    const Wide3 d = unit(product(r, widen(direction)));
    g.directions.push_back({round_to_real(d[0]), round_to_real(d[1]), round_to_real(d[2])});
  }
  return g;
}

std::string metres(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g m", x);
  return text;
}

}  // namespace

std::array<long double, 4> unit_quaternion(const std::array<double, 4>& wxyz,
                                           const std::string& place) {
  std::array<Wide, 4> q{};
  std::copy(wxyz.begin(), wxyz.end(), q.begin());
  const Wide length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (!(std::abs(length - 1) <= 1e-6L)) {
    throw InputError(place + ": quaternion of length " + std::to_string(length) +
                     " is not of unit length; divide it by its length");
  }
  for (Wide& x : q) x /= length;
  return q;
}

BodyGeometry moving_geometry(const PlacedBody& placed, const std::array<double, 3>& grip_m,
                             const std::vector<PieceTopology>& topologies) {
  const Wide3 shift = widen(placed.mesh_origin_m) - widen(grip_m);
  BodyGeometry g = place_body(placed.body, topologies, kIdentity, shift);
  g.reference_m = grip_m;
  return g;
}

void set_held_part(HeldPartParameters& held, const PlacedBody& placed,
                   const std::array<double, 3>& grip_m) {
  if (!(held.mass_kg > 0.0)) return;
  const Wide3 shift = widen(placed.mesh_origin_m) - widen(grip_m);
  Wide volume = 0;  // of a surface its area
  Wide3 first{0, 0, 0};
  WideMatrix second{};
  for (const ConvexPiece& piece : placed.body.pieces) {
    if (piece.is_facet()) {
      // A shell: triangles, A, A / 3 times the sum of the corners, A / 12 times the sum of the
      // corners' squares and the square of their sum.
      const std::vector<std::uint32_t>& loop = piece.faces[0].loop;
      for (std::size_t k = 2; k < loop.size(); ++k) {
        const Wide3 corners[] = {widen(piece.vertices[loop[0]]) + shift,
                                 widen(piece.vertices[loop[k - 1]]) + shift,
                                 widen(piece.vertices[loop[k]]) + shift};
        const Wide area = norm(cross(corners[1] - corners[0], corners[2] - corners[0])) / 2;
        const Wide3 sum = corners[0] + corners[1] + corners[2];
        volume += area;
        for (std::size_t i = 0; i < 3; ++i) {
          first[i] += area * sum[i] / 3;
          for (std::size_t j = 0; j < 3; ++j) {
            Wide squares = sum[i] * sum[j];
            for (const Wide3& x : corners) squares += x[i] * x[j];
            second[i][j] += area * squares / 12;
          }
        }
      }
      continue;
    }
    // Tetrahedra from one vertex to the triangles of every face: V, V / 4 times the sum of the
    // corners, V / 20 times the sum of the corners' squares and the square of their sum.
    const auto corner = [&](std::size_t v) { return widen(piece.vertices[v]) + shift; };
    const Wide3 apex = corner(0);
    for (const PieceFace& face : piece.faces) {
      for (std::size_t k = 2; k < face.loop.size(); ++k) {
        const Wide3 corners[] = {apex, corner(face.loop[0]), corner(face.loop[k - 1]),
                                 corner(face.loop[k])};
        const Wide v = dot(corners[1] - apex, cross(corners[2] - apex, corners[3] - apex)) / 6;
        const Wide3 sum = corners[0] + corners[1] + corners[2] + corners[3];
        volume += v;
        for (std::size_t i = 0; i < 3; ++i) {
          first[i] += v * sum[i] / 4;
          for (std::size_t j = 0; j < 3; ++j) {
            Wide squares = sum[i] * sum[j];
            for (const Wide3& x : corners) squares += x[i] * x[j];
            second[i][j] += v * squares / 20;
          }
        }
      }
    }
  }
  const Wide density = static_cast<Wide>(held.mass_kg) / volume;
  const Wide trace = second[0][0] + second[1][1] + second[2][2];
  constexpr std::size_t kEntries[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};
  for (std::size_t k = 0; k < 6; ++k) {
    const auto [i, j] = kEntries[k];
    held.inertia_kg_m2[k] = round_to_double(density * ((i == j ? trace : 0) - second[i][j]));
  }
  for (std::size_t k = 0; k < 3; ++k) held.centre_m[k] = round_to_double(first[k] / volume);
}

BodyGeometry static_geometry(const PlacedBody& placed,
                             const std::vector<PieceTopology>& topologies) {
  const WideMatrix r = rotation_matrix(unit_quaternion(placed.quaternion_wxyz, placed.body.name));
  const Wide3 origin = product(r, widen(placed.mesh_origin_m)) + widen(placed.position_m);
  Wide3 low{}, high{};
  bool first = true;
  for (const ConvexPiece& piece : placed.body.pieces) {
    for (const auto& v : piece.vertices) {
      const Wide3 x = product(r, widen(v));
      for (std::size_t k = 0; k < 3; ++k) {
        low[k] = first ? x[k] : std::min(low[k], x[k]);
        high[k] = first ? x[k] : std::max(high[k], x[k]);
      }
      first = false;
    }
  }
  const Wide size = std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]});
  const Wide grid = size > 0 ? std::ldexp(Wide{1}, std::ilogb(size) - 5) : Wide{1};
  std::array<double, 3> reference{};
  for (std::size_t k = 0; k < 3; ++k) {
    reference[k] =
        round_to_double(grid * std::floor((origin[k] + (low[k] + high[k]) / 2) / grid + 0.5L));
  }
  // origin - reference first: the rest of the sum is then as small as the body itself.
  BodyGeometry g = place_body(placed.body, topologies, r, origin - widen(reference));
  g.reference_m = reference;
  return g;
}

void check_geometry(const BodyGeometry& geometry, std::size_t index, const PieceTopology& topology,
                    const std::string& place) {
  const PieceGeometry& piece = geometry.pieces[index];
  std::vector<Wide3> vertices;
  Wide scale = 0;
  for (const auto& v : piece.vertices) {
    vertices.push_back(widen(v));
    for (const Real x : v) {
      if (!check::finite(x)) throw InputError(place + ": a vertex coordinate is not finite");
      scale = std::max(scale, std::abs(static_cast<Wide>(x)));
    }
  }
  const Wide tolerance = static_cast<Wide>(check::kGeometryTolerance) * scale;
  for (std::size_t f = 0; f < topology.faces.size(); ++f) {
    const FaceRecord& face = topology.faces[f];
    const PlaneRecord& plane = geometry.planes[face.plane];
    const Wide sign = face.sign;
    const Wide3 normal{static_cast<Wide>(plane.normal[0]), static_cast<Wide>(plane.normal[1]),
                       static_cast<Wide>(plane.normal[2])};
    const Wide3 n{sign * normal[0], sign * normal[1], sign * normal[2]};
    const Wide offset = sign * static_cast<Wide>(plane.offset_m);
    if (!(std::abs(dot(n, n) - 1) < static_cast<Wide>(check::kGeometryTolerance))) {
      throw InputError(place + ": plane " + std::to_string(face.plane) +
                       " has a normal that is not of unit length");
    }
    const auto* loop = topology.loop_vertices.data() + face.loop_begin;
    std::vector<bool> on_face(vertices.size(), false);
    for (std::uint32_t k = 0; k < face.loop_count; ++k) on_face[loop[k]] = true;
    for (std::size_t v = 0; v < vertices.size(); ++v) {
      const Wide height = dot(n, vertices[v]) - offset;
      if (!(height <= tolerance) || (on_face[v] && !(height >= -tolerance))) {
        const std::string text =
            place + ": vertex " + std::to_string(v) +
            (on_face[v] ? " lies off the plane of its face " : " is outside face ") +
            std::to_string(f) + " by " + metres(static_cast<double>(height)) +
            " (rounding allows " + metres(static_cast<double>(tolerance)) +
            "); the piece is not convex, or its numbers carry too few digits";
        // Both sides of a facet hold all its vertices.
        if (topology.faces.size() <= 2) throw FacetNotFlat(text);
        throw InputError(text);
      }
    }
    Wide3 area{0, 0, 0};
    for (std::uint32_t k = 2; k < face.loop_count; ++k) {
      area = area + cross(vertices[loop[k - 1]] - vertices[loop[0]],
                          vertices[loop[k]] - vertices[loop[0]]);
    }
    if (!(dot(area, n) > 0)) {
      // The corners of a face no wider than rounding may come to lie in any order.
      Wide around = 0;
      for (std::uint32_t k = 0; k < face.loop_count; ++k) {
        const Wide3 side = vertices[loop[k]] - vertices[loop[k == 0 ? face.loop_count - 1 : k - 1]];
        around += std::sqrt(dot(side, side));
      }
      const std::string text = place + ": face " + std::to_string(f);
      if (dot(area, n) > -tolerance * around) {
        throw InputError(text + " is as thin as rounding (" +
                         metres(static_cast<double>(tolerance)) + "); simplify the part" +
                         (HAPTIC_REAL_IS_FLOAT ? ", or build for double precision" : ""));
      }
      throw InputError(text +
                       " is not counter-clockwise seen from outside; turn its loop or its sign");
    }
  }
}

}  // namespace haptic::tools
