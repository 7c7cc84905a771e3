// SPDX-License-Identifier: Apache-2.0
// The C-obstacles of a scene whose part never turns, against its pieces: every number of every
// plane and node is that of its basic contact within rounding. That the edge pairs are complete is
// the compiler's work; with any content, each plane is a true bound.
#include <algorithm>
#include <cmath>

#include "rt_core/scene/graph_rule.hpp"
#include "rt_core/scene/scene_check.hpp"
#include "rt_core/scene/scene_view.hpp"

namespace haptic {
namespace {

using check::cross;
using check::dot;
using check::Double3;

/// Vertex of the moving piece turned, from its lanes.
Double3 lane_vertex(const PieceView& p, std::uint32_t v) noexcept {
  return {static_cast<double>(p.lanes[v]), static_cast<double>(p.lanes[p.lane_count + v]),
          static_cast<double>(p.lanes[2 * std::size_t{p.lane_count} + v])};
}

/// The pieces of a pair, A turned.
struct TurnedPair {
  const PairView& pair;
  double scale = 0;  ///< sum of the reaches [m]

  [[nodiscard]] double lowest_a(const Double3& n) const noexcept {
    double least = dot(n, lane_vertex(pair.a, 0));
    for (std::uint32_t v = 1; v < pair.a.vertex_count; ++v)
      least = std::min(least, dot(n, lane_vertex(pair.a, v)));
    return least;
  }
  [[nodiscard]] double highest_b(const Double3& n) const noexcept {
    double most = dot(n, check::vertex_of(pair.b, 0));
    for (std::uint32_t v = 1; v < pair.b.vertex_count; ++v)
      most = std::max(most, dot(n, check::vertex_of(pair.b, v)));
    return most;
  }
  /// n . (b - R a) of a basic contact: its value at y is n . y less this.
  [[nodiscard]] double height(ContactType type, std::uint32_t i, std::uint32_t j,
                              const Double3& n) const noexcept {
    const std::uint32_t a = type == ContactType::kA   ? pair.a.face_vertices(i)[0]
                            : type == ContactType::kB ? i
                                                      : pair.a.edges[i].vertex[0];
    const std::uint32_t b = type == ContactType::kA   ? j
                            : type == ContactType::kB ? pair.b.face_vertices(j)[0]
                                                      : pair.b.edges[j].vertex[0];
    return dot(n, check::vertex_of(pair.b, b)) - dot(n, lane_vertex(pair.a, a));
  }
};

ContactType type_of(const FixedPlane& plane) noexcept {
  return static_cast<ContactType>(plane.type);
}

bool in_range(const PairView& pair, ContactType type, std::uint32_t i, std::uint32_t j) noexcept {
  const PieceView &a = pair.a, &b = pair.b;
  switch (type) {
    case ContactType::kA:
      return i < a.face_count && j < b.vertex_count;
    case ContactType::kB:
      return i < a.vertex_count && j < b.face_count;
    case ContactType::kC:
      return i < a.edge_count && j < b.edge_count;
  }
  return false;
}

/// Run of the plane with this number, and its feature where the run is one of faces.
bool place_fits(const PairView& pair, std::uint32_t k, const FixedPlane& plane) noexcept {
  const std::uint32_t faces_a = pair.a.face_count, faces = faces_a + pair.b.face_count;
  if (k < faces_a) return type_of(plane) == ContactType::kA && plane.i == k;
  if (k < faces) return type_of(plane) == ContactType::kB && plane.j == k - faces_a;
  return type_of(plane) == ContactType::kC;
}

/// The normal is square to the edges that a basic contact holds: those of its face, or its own two.
bool is_square(const PairView& pair, ContactType type, std::uint32_t i, std::uint32_t j,
               const Double3& n, double tolerance) noexcept {
  const auto flat_a = [&](std::uint32_t u, std::uint32_t v) {
    return check::absolute(dot(n, lane_vertex(pair.a, u) - lane_vertex(pair.a, v))) <= tolerance;
  };
  const auto flat_b = [&](std::uint32_t u, std::uint32_t v) {
    const Double3 along = check::vertex_of(pair.b, u) - check::vertex_of(pair.b, v);
    return check::absolute(dot(n, along)) <= tolerance;
  };
  if (type == ContactType::kC) {
    const EdgeRecord &e = pair.a.edges[i], &g = pair.b.edges[j];
    return flat_a(e.vertex[0], e.vertex[1]) && flat_b(g.vertex[0], g.vertex[1]);
  }
  const bool of_a = type == ContactType::kA;
  const auto loop = of_a ? pair.a.face_vertices(i) : pair.b.face_vertices(j);
  for (const std::uint16_t v : loop) {
    if (of_a ? !flat_a(v, loop[0]) : !flat_b(v, loop[0])) return false;
  }
  return true;
}

RtStatus check_node(const TurnedPair& turned, const FixedPlane& plane, const FixedNode& node,
                    double epsilon_m) noexcept {
  const PairView& pair = turned.pair;
  const double tolerance = 8 * check::kGeometryTolerance * turned.scale;
  if (node.type > 2) return RtStatus::kBlobBadNumber;
  const auto type = static_cast<ContactType>(node.type);
  if (!in_range(pair, type, node.i, node.j)) return RtStatus::kBlobBadIndex;
  const Double3 n = check::to_double3(plane.normal);
  const bool on_plane = type == ContactType::kC
                            ? is_square(pair, type, node.i, node.j, n, tolerance)
                        : type != type_of(plane)  ? false
                        : type == ContactType::kA ? node.i == plane.i
                                                  : node.j == plane.j;
  if (!on_plane) return RtStatus::kBlobBadGraph;
  const double rise = static_cast<double>(node.rise_m);
  const double wanted =
      static_cast<double>(plane.offset_m) - turned.height(type, node.i, node.j, n);
  if (!(check::absolute(rise - wanted) <= tolerance)) return RtStatus::kBlobBadNumber;
  const double violation = static_cast<double>(node.violation_m);
  const bool fits =
      violation <= epsilon_m * (1 + check::kGeometryTolerance) && -violation <= 2 * turned.scale;
  return fits ? RtStatus::kOk : RtStatus::kBlobBadNumber;
}

RtStatus check_plane(const TurnedPair& turned, const FixedPlane& plane, double epsilon_m) noexcept {
  const PairView& pair = turned.pair;
  const double tolerance = 4 * check::kGeometryTolerance * turned.scale;
  const Double3 n = check::to_double3(plane.normal);
  const bool is_unit = check::absolute(dot(n, n) - 1.0) <= 4 * check::kGeometryTolerance;
  if (!is_unit || !is_square(pair, type_of(plane), plane.i, plane.j, n, tolerance))
    return RtStatus::kBlobBadNumber;
  const double offset = static_cast<double>(plane.offset_m);
  const double support = turned.highest_b(n) - turned.lowest_a(n);
  if (!(check::absolute(offset - support) <= tolerance)) return RtStatus::kBlobBadNumber;
  for (std::uint32_t k = 0; k < plane.node_count; ++k) {
    const RtStatus status =
        check_node(turned, plane, pair.plane_nodes[plane.node_begin + k], epsilon_m);
    if (status != RtStatus::kOk) return status;
  }
  return RtStatus::kOk;
}

}  // namespace

RtStatus SceneView::check_fixed_pair(std::uint32_t index, std::uint64_t& planes,
                                     std::uint64_t& nodes) const noexcept {
  const RtStatus place = check_place(index);
  if (place != RtStatus::kOk) return place;
  const FixedPairRecord& r = fixed_pairs_[index];
  if (r.plane_begin != planes || r.node_begin != nodes || r.hidden > 1)
    return RtStatus::kBlobBadCount;
  planes += r.plane_count;
  nodes += r.node_count;
  if (planes > fixed_planes_.size() || nodes > fixed_nodes_.size() ||
      r.bounding_count > r.plane_count) {
    return RtStatus::kBlobBadCount;
  }
  const PairView v = pair(index);
  if (r.bounding_count < v.a.face_count + v.b.face_count) return RtStatus::kBlobBadCount;
  const bool capacities =
      pairs_[index].near_capacity == r.node_count && pairs_[index].edge_pair_capacity == 0;
  if (!capacities) return RtStatus::kBlobBadCapacity;
  const TurnedPair turned{v, v.a.record->reach_m + v.b.record->reach_m};
  std::uint64_t on_planes = 0;
  bool bears = true;
  for (std::uint32_t k = 0; k < r.plane_count; ++k) {
    const FixedPlane& plane = v.planes[k];
    if (plane.type > 2 || plane.force > 2 || plane.reserved != 0) return RtStatus::kBlobBadNumber;
    if (type_of(plane) == ContactType::kC && has_force(plane, PlaneForce::kElsewhere))
      return RtStatus::kBlobBadNumber;
    if (plane.node_count > 0 && has_force(plane, PlaneForce::kHidden))
      return RtStatus::kBlobBadGraph;
    if (plane.node_begin != on_planes) return RtStatus::kBlobBadCount;
    on_planes += plane.node_count;
    if (on_planes > r.node_count) return RtStatus::kBlobBadCount;
    if (!in_range(v, type_of(plane), plane.i, plane.j) || !place_fits(v, k, plane))
      return RtStatus::kBlobBadIndex;
    const RtStatus status = check_plane(turned, plane, parameters_->epsilon_m);
    if (status != RtStatus::kOk) return status;
    bears = bears && has_force(plane, PlaneForce::kBears);
  }
  if (!bears && r.hidden == 0) return RtStatus::kBlobBadGraph;
  return on_planes == r.node_count ? RtStatus::kOk : RtStatus::kBlobBadCount;
}

}  // namespace haptic
