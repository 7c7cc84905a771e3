// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/pruning/piece_overlap.hpp"

#include <algorithm>

namespace haptic::tools {
namespace {

/// Local coordinates are about 1 and rounded once.
constexpr double kBoxMargin = 1.0e-12;

/// The part of a strictly convex polygon with sign * side <= 0; empty when it has no area.
Loop clipped(ExactWorld& world, const Loop& polygon, std::uint32_t plane, int sign) {
  Loop kept;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const std::uint32_t u = polygon[k], v = polygon[(k + 1) % polygon.size()];
    const int at_u = sign * world.side(u, plane), at_v = sign * world.side(v, plane);
    if (at_u <= 0) kept.push_back(u);
    if (at_u * at_v < 0) kept.push_back(world.cut_edge(u, v, plane));
  }
  // A strictly convex polygon meets a line in two of its vertices at most.
  if (kept.size() < 3) kept.clear();
  return kept;
}

}  // namespace

BoxedPiece::BoxedPiece(const ExactWorld& world, const Solid& piece) : hull(piece) {
  for (const std::uint32_t v : hull.vertices) box.include(world.vertices[v].x_approx);
  box = box.grown(kBoxMargin);
}

bool BoxedPiece::has_plane(const OrientedPlane& plane) const {
  return std::find(hull.planes.begin(), hull.planes.end(),
                   std::pair<std::uint32_t, int>(plane.plane, plane.sign)) != hull.planes.end();
}

bool cut_away(ExactWorld& world, const BoxedPiece& piece, const OrientedPlane& own,
              std::vector<Loop>& polygons) {
  bool any = false;
  std::vector<Loop> left;
  for (Loop& polygon : polygons) {
    Loop rest = polygon;
    std::vector<Loop> outside;
    for (const auto& [plane, sign] : piece.hull.planes) {
      if (plane == own.plane) continue;
      Loop beyond = clipped(world, rest, plane, -sign);
      if (!beyond.empty()) outside.push_back(std::move(beyond));
      rest = clipped(world, rest, plane, sign);
      if (rest.empty()) break;
    }
    if (rest.empty()) {
      left.push_back(std::move(polygon));
    } else {
      any = true;
      left.insert(left.end(), outside.begin(), outside.end());
    }
  }
  polygons = std::move(left);
  return any;
}

std::optional<SegmentOverlap> overlap_of(ExactWorld& world, const BoxedPiece& piece,
                                         std::uint32_t u, std::uint32_t v) {
  SegmentOverlap part{u, v, {}};
  for (const auto& [plane, sign] : piece.hull.planes) {
    const int at_begin = sign * world.side(part.begin, plane);
    const int at_end = sign * world.side(part.end, plane);
    if (at_begin == 0 && at_end == 0) part.active.push_back({plane, sign});
    if (at_begin <= 0 && at_end <= 0) continue;
    if (at_begin >= 0 && at_end >= 0) return std::nullopt;
    // The whole edge crosses where its part does; cutting the whole keeps the numbers short.
    (at_begin > 0 ? part.begin : part.end) = world.cut_edge(u, v, plane);
  }
  if (part.begin == part.end) return std::nullopt;
  return part;
}

bool contains(ExactWorld& world, const BoxedPiece& piece, std::uint32_t vertex) {
  for (const auto& [plane, sign] : piece.hull.planes) {
    if (sign * world.side(vertex, plane) > 0) return false;
  }
  return true;
}

}  // namespace haptic::tools
