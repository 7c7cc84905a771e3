// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/surface/surface_body.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <utility>

#include "tools/graph_compiler/graph/wide3.hpp"

namespace haptic::tools {
namespace {

using Facet = SurfacePart::Facet;

/// Twice the area of a facet as a vector along its normal (Newell).
Wide3 area_vector(const SurfacePart& part, const Facet& facet) {
  const Wide3 origin = widen(part.vertices_m[facet.loop[0]]);
  Wide3 sum{0, 0, 0};
  for (std::size_t k = 2; k < facet.loop.size(); ++k) {
    sum = sum + cross(widen(part.vertices_m[facet.loop[k - 1]]) - origin,
                      widen(part.vertices_m[facet.loop[k]]) - origin);
  }
  return sum;
}

/// The plane halfway between the lowest and the highest corner.
BodyPlane plane_of(const SurfacePart& part, const Facet& facet, const Wide3& normal) {
  Wide low = 0, high = 0;
  for (std::size_t k = 0; k < facet.loop.size(); ++k) {
    const Wide height = dot(normal, widen(part.vertices_m[facet.loop[k]]));
    low = k == 0 ? height : std::min(low, height);
    high = k == 0 ? height : std::max(high, height);
  }
  BodyPlane plane;
  for (std::size_t i = 0; i < 3; ++i) plane.normal[i] = static_cast<double>(normal[i]);
  plane.offset_m = static_cast<double>((low + high) / 2);
  return plane;
}

ConvexPiece piece_of(const SurfacePart& part, std::size_t f, std::uint32_t plane) {
  const Facet& facet = part.facets[f];
  const auto inward = static_cast<std::uint32_t>(part.ring.size());  // behind those of the vertices
  ConvexPiece piece;
  std::vector<std::uint32_t> loop(facet.loop.size());
  std::iota(loop.begin(), loop.end(), 0u);
  for (std::size_t k = 0; k < loop.size(); ++k) {
    const std::uint32_t v = facet.loop[k];
    const Point3& at = part.vertices_m[v];
    piece.vertices.push_back({at[0], at[1], at[2]});
    piece.vertex_cones.push_back({part.ring_begin[v], part.ring_begin[v + 1] - part.ring_begin[v]});
    const std::uint32_t e = part.edge_of[part.side_begin[f] + k];
    piece.side_cones.push_back(
        {inward + part.inward_begin[e], part.inward_begin[e + 1] - part.inward_begin[e]});
  }
  const std::int64_t source = part.source_face.empty() ? -1 : std::int64_t{part.source_face[f]};
  piece.faces.push_back({plane, 1, loop, source});
  std::reverse(loop.begin(), loop.end());
  piece.faces.push_back({plane, -1, std::move(loop), source});
  return piece;
}

}  // namespace

Body surface_body(const SurfacePart& part, const std::string& name) {
  Body body;
  body.name = name;
  for (const std::vector<Point3>* directions : {&part.ring, &part.inward}) {
    for (const Point3& d : *directions) body.directions.push_back({d[0], d[1], d[2]});
  }
  Wide area = 0;
  Wide3 moment{0, 0, 0};
  for (std::size_t f = 0; f < part.facets.size(); ++f) {
    const Facet& facet = part.facets[f];
    const Wide3 normal = unit(area_vector(part, facet));
    body.planes.push_back(plane_of(part, facet, normal));
    body.pieces.push_back(piece_of(part, f, static_cast<std::uint32_t>(f)));
    const Wide3 origin = widen(part.vertices_m[facet.loop[0]]);
    for (std::size_t k = 2; k < facet.loop.size(); ++k) {
      const Wide3 p = widen(part.vertices_m[facet.loop[k - 1]]);
      const Wide3 q = widen(part.vertices_m[facet.loop[k]]);
      const Wide twice = dot(normal, cross(p - origin, q - origin));
      area += twice;
      moment = moment + (twice / 3) * (origin + p + q);
    }
  }
  for (std::size_t i = 0; i < 3; ++i)
    body.centre_of_volume_m[i] = static_cast<double>(moment[i] / area);
  return body;
}

}  // namespace haptic::tools
