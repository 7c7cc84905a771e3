// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/pruning/exposure.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <optional>
#include <stdexcept>

#include "tools/graph_compiler/mesh/vec3.hpp"
#include "tools/graph_compiler/polyhedron/separation.hpp"
#include "tools/graph_compiler/pruning/spherical_sets.hpp"

namespace haptic::tools {
namespace {

// The intersection of two convex pieces of one body on a face or an edge of one of them, exactly.

/// A plane of the table and the side that is outward.
struct OrientedPlane {
  std::uint32_t plane = 0;
  int sign = 1;
  bool operator==(const OrientedPlane&) const = default;
};

/// A piece prepared for overlaps: planes, vertices, and a box of rounded coordinates.
struct BoxedPiece {
  BoxedPiece(const ExactWorld& world, const Solid& piece);
  PieceHull hull;
  vec::Box box;  ///< local units, wider than the rounding
  [[nodiscard]] bool has_plane(const OrientedPlane& plane) const;
};

/// Part of the segment (u, v) within a piece, ends included.
struct SegmentOverlap {
  std::uint32_t begin = 0, end = 0;   ///< vertices of the world, from u to v; never equal
  std::vector<OrientedPlane> active;  ///< planes of the piece that hold the whole part
};

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

BoxedPiece::BoxedPiece(const ExactWorld& world, const Solid& piece) : hull(piece) {
  for (const std::uint32_t v : hull.vertices) box.include(world.vertices[v].x_approx);
  box = box.grown(kBoxMargin);
}

bool BoxedPiece::has_plane(const OrientedPlane& plane) const {
  return std::find(hull.planes.begin(), hull.planes.end(),
                   std::pair<std::uint32_t, int>(plane.plane, plane.sign)) != hull.planes.end();
}

/// Cuts away from `polygons` (strictly convex, in the plane `own`) what `piece` covers of their
/// interiors. A piece that only touches leaves them as they are. True when something was cut.
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

/// Nothing where the piece meets the segment in a point at most.
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

/// True when the vertex lies in the piece, its boundary included.
bool contains(ExactWorld& world, const BoxedPiece& piece, std::uint32_t vertex) {
  for (const auto& [plane, sign] : piece.hull.planes) {
    if (sign * world.side(vertex, plane) > 0) return false;
  }
  return true;
}

/// Edge (u, v), u < v, of a piece; face[0] has it as u -> v, face[1] as v -> u.
struct ExactEdge {
  std::uint32_t u = 0, v = 0;
  std::array<std::size_t, 2> face{};
};

/// Outward normals at an edge, counter-clockwise about u -> v; shorter than pi.
struct PlaneArc {
  OrientedPlane from, to;
  bool operator==(const PlaneArc&) const = default;
};

/// An elementary stretch of an edge, between neighbouring ends of overlaps.
struct Stretch {
  Rational begin, end;
  std::optional<PlaneArc> arc;  ///< nothing: hidden
};

class BodyExposure {
 public:
  BodyExposure(const FlatBody& body, const std::vector<Solid>& pieces)
      : world_(body.world), solids_(pieces) {
    world_.work_limit = std::numeric_limits<double>::infinity();
    for (const Solid& piece : pieces) {
      pieces_.emplace_back(world_, piece);
      edges_.push_back(edges_of(piece));
    }
  }

  std::vector<PieceExposure> run() {
    std::vector<PieceExposure> result(solids_.size());
    for (std::size_t i = 0; i < solids_.size(); ++i) {
      others_.clear();
      for (std::size_t j = 0; j < solids_.size(); ++j) {
        if (j != i && pieces_[i].box.meets(pieces_[j].box)) others_.push_back(j);
      }
      expose_faces(i, result[i]);
      expose_edges(i, result[i]);
      expose_vertices(i, result[i]);
    }
    return result;
  }

 private:
  static std::vector<ExactEdge> edges_of(const Solid& piece) {
    std::map<ChainEdge, ExactEdge> edges;
    for (std::size_t f = 0; f < piece.faces.size(); ++f) {
      for (const auto& [u, v] : piece.faces[f].edges) {
        ExactEdge& edge = edges[std::minmax(u, v)];
        edge.u = std::min(u, v);
        edge.v = std::max(u, v);
        edge.face[u < v ? 0 : 1] = f;
      }
    }
    std::vector<ExactEdge> sorted;
    for (const auto& [ends, edge] : edges) sorted.push_back(edge);
    return sorted;
  }

  [[nodiscard]] std::array<double, 3> point(std::uint32_t v) const {
    std::array<double, 3> x{};
    for (std::size_t k = 0; k < 3; ++k) {
      x[k] = world_.vertices[v].x_approx[k] / world_.scale + world_.centre_m[k];
    }
    return x;
  }

  [[nodiscard]] Direction normal(const OrientedPlane& p) const {
    return vec::scaled(world_.planes[p.plane].unit_normal, p.sign);
  }

  void expose_faces(std::size_t i, PieceExposure& exposure) {
    for (const ExactFace& face : solids_[i].faces) {
      const OrientedPlane own{face.plane, face.sign};
      std::vector<Loop> open = trace_loops(world_, face);
      bool cut = false;
      for (const std::size_t j : others_) {
        if (!pieces_[j].has_plane(own)) cut |= cut_away(world_, pieces_[j], own, open);
      }
      exposure.face_hidden.push_back(open.empty());
      std::vector<FragmentPolygon> fragments;
      for (const Loop& loop : cut ? open : std::vector<Loop>{}) {
        FragmentPolygon& polygon = fragments.emplace_back();
        for (const std::uint32_t v : loop) polygon.push_back(point(v));
      }
      exposure.face_fragments.push_back(std::move(fragments));
    }
  }

  /// Sign of the turn from p to q about u -> v.
  int turn(const OrientedPlane& p, const OrientedPlane& q, const ExactEdge& edge) {
    return p.sign * q.sign * world_.turn(p.plane, q.plane, edge.u, edge.v);
  }

  bool in_arc(const OrientedPlane& p, const PlaneArc& arc, const ExactEdge& edge) {
    return p == arc.from || p == arc.to ||
           (turn(arc.from, p, edge) > 0 && turn(p, arc.to, edge) > 0);
  }

  /// Directions common to two arcs about one line; nothing unless they are more than a point.
  std::optional<PlaneArc> common(const PlaneArc& a, const PlaneArc& b, const ExactEdge& edge) {
    const bool b_begins = in_arc(b.from, a, edge), b_ends = in_arc(b.to, a, edge);
    if (!b_begins && !in_arc(a.from, b, edge)) return std::nullopt;
    if (!b_ends && !in_arc(a.to, b, edge)) return std::nullopt;
    const PlaneArc both{b_begins ? b.from : a.from, b_ends ? b.to : a.to};
    if (turn(both.from, both.to, edge) <= 0) return std::nullopt;
    return both;
  }

  /// The rest of an arc without `overlap`: a piece that does not end in an edge here leaves at most
  /// a direction.
  std::optional<PlaneArc> left_by(const SegmentOverlap& overlap, const PlaneArc& arc,
                                  const ExactEdge& edge) {
    if (overlap.active.size() < 2) return std::nullopt;
    PlaneArc other{overlap.active[0], overlap.active[1]};
    if (turn(other.from, other.to, edge) < 0) std::swap(other.from, other.to);
    return common(arc, other, edge);
  }

  /// Share of the way from u to v.
  Rational share(const ExactEdge& edge, std::uint32_t w) {
    const auto &a = world_.vertices[edge.u], &b = world_.vertices[edge.v];
    std::size_t k = 0;
    for (std::size_t i = 1; i < 3; ++i) {
      if (std::abs(b.x_approx[i] - a.x_approx[i]) > std::abs(b.x_approx[k] - a.x_approx[k])) k = i;
    }
    return (world_.vertices[w].x[k] - a.x[k]) / (b.x[k] - a.x[k]);
  }

  std::vector<Stretch> stretches(const ExactEdge& edge, const PlaneArc& whole) {
    std::vector<std::pair<SegmentOverlap, std::array<Rational, 2>>> overlaps;
    std::vector<Rational> ends{Rational(0), Rational(1)};
    for (const std::size_t j : others_) {
      auto overlap = overlap_of(world_, pieces_[j], edge.u, edge.v);
      if (!overlap) continue;
      const Rational begin = share(edge, overlap->begin), end = share(edge, overlap->end);
      ends.push_back(begin);
      ends.push_back(end);
      overlaps.emplace_back(std::move(*overlap), std::array{begin, end});
    }
    std::sort(ends.begin(), ends.end());
    ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
    std::vector<Stretch> result;
    for (std::size_t k = 0; k + 1 < ends.size(); ++k) {
      Stretch stretch{ends[k], ends[k + 1], whole};
      for (const auto& [overlap, span] : overlaps) {
        if (!stretch.arc || span[0] > ends[k] || span[1] < ends[k + 1]) continue;
        stretch.arc = left_by(overlap, *stretch.arc, edge);
      }
      const bool goes_on = !result.empty() && result.back().arc == stretch.arc;
      if (goes_on) {
        result.back().end = stretch.end;
      } else {
        result.push_back(std::move(stretch));
      }
    }
    return result;
  }

  void expose_edges(std::size_t i, PieceExposure& exposure) {
    const std::vector<ExactFace>& faces = solids_[i].faces;
    for (const ExactEdge& edge : edges_[i]) {
      const ExactFace &left = faces[edge.face[0]], &right = faces[edge.face[1]];
      const PlaneArc whole{{left.plane, left.sign}, {right.plane, right.sign}};
      std::vector<ExposedArc> open;
      for (const Stretch& stretch : stretches(edge, whole)) {
        if (!stretch.arc) continue;
        open.push_back({to_double(stretch.begin), to_double(stretch.end), normal(stretch.arc->from),
                        normal(stretch.arc->to)});
      }
      exposure.edge_hidden.push_back(open.empty());
      exposure.edge_arcs.push_back(std::move(open));
    }
  }

  /// Unit directions along which the edges of piece `j` leave vertex `v`.
  void add_directions(std::size_t j, std::uint32_t v, std::vector<Direction>& to) const {
    for (const ExactEdge& edge : edges_[j]) {
      if (edge.u != v && edge.v != v) continue;
      const std::uint32_t other = edge.u == v ? edge.v : edge.u;
      to.push_back(
          vec::unit(vec::sub(world_.vertices[other].x_approx, world_.vertices[v].x_approx)));
    }
  }

  /// An open edge of piece `i` ends at its vertex `v`: no other piece carries it on.
  bool edge_ends_at(std::size_t i, std::uint32_t v) {
    const std::vector<ExactFace>& faces = solids_[i].faces;
    for (const ExactEdge& edge : edges_[i]) {
      if (edge.u != v && edge.v != v) continue;
      const ExactFace &left = faces[edge.face[0]], &right = faces[edge.face[1]];
      const std::vector<Stretch> all =
          stretches(edge, {{left.plane, left.sign}, {right.plane, right.sign}});
      const Stretch& last = edge.u == v ? all.front() : all.back();
      if (last.arc && !goes_on(*last.arc, v, edge.u == v ? edge.v : edge.u)) return true;
    }
    return false;
  }

  /// Another piece has the edge between the planes of `arc` at `v`, on the side away from `from`.
  bool goes_on(const PlaneArc& arc, std::uint32_t v, std::uint32_t from) {
    const auto& x = world_.vertices;
    const auto back = vec::sub(x[from].x_approx, x[v].x_approx);
    for (const std::size_t j : others_) {
      if (!contains(world_, pieces_[j], v)) continue;
      for (const ExactEdge& edge : edges_[j]) {
        const auto plane = [&](std::size_t k) -> OrientedPlane {
          const ExactFace& face = solids_[j].faces[edge.face[k]];
          return {face.plane, face.sign};
        };
        if (!(plane(0) == arc.from && plane(1) == arc.to) &&
            !(plane(1) == arc.from && plane(0) == arc.to)) {
          continue;
        }
        for (const std::uint32_t end : {edge.u, edge.v}) {
          if (end != v && vec::dot(vec::sub(x[end].x_approx, x[v].x_approx), back) < 0) return true;
        }
      }
    }
    return false;
  }

  void expose_vertices(std::size_t i, PieceExposure& exposure) {
    for (const std::uint32_t v : pieces_[i].hull.vertices) {
      std::vector<Direction> own;
      add_directions(i, v, own);
      std::vector<Direction> all = own;
      bool hidden = false;
      for (const std::size_t j : others_) {
        if (hidden || !contains(world_, pieces_[j], v)) continue;
        const std::vector<std::uint32_t>& corners = pieces_[j].hull.vertices;
        hidden = !std::binary_search(corners.begin(), corners.end(), v);
        add_directions(j, v, all);
      }
      std::vector<Direction> narrowed;
      if (!hidden && all.size() > own.size()) {
        const SphericalPolygon cone = spherical_polygon(all);
        hidden = !is_open(cone);
        if (!hidden && narrows(own, all)) narrowed = cone.sides;
      }
      exposure.edge_end.push_back(hidden && edge_ends_at(i, v));
      exposure.vertex_hidden.push_back(hidden);
      exposure.vertex_cone.push_back(std::move(narrowed));
    }
  }

  static bool is_open(const SphericalPolygon& cone) {
    Direction middle{0, 0, 0};
    for (const Direction& corner : cone.corners) middle = vec::add(middle, corner);
    middle = vec::unit(middle);
    return cone.corners.size() >= 3 &&
           std::all_of(cone.sides.begin(), cone.sides.end(), [&](const Direction& d) {
             return vec::dot(middle, d) < -kThinnestCone_rad;
           });
  }

  /// True when some direction cuts off a corner of the cone that `own` make alone.
  static bool narrows(const std::vector<Direction>& own, const std::vector<Direction>& all) {
    for (const Direction& corner : spherical_polygon(own).corners) {
      for (const Direction& d : all) {
        if (vec::dot(corner, d) > kThinnestCone_rad) return true;
      }
    }
    return false;
  }

  ExactWorld world_;  ///< a copy: overlaps add vertices
  const std::vector<Solid>& solids_;
  std::vector<BoxedPiece> pieces_;
  std::vector<std::vector<ExactEdge>> edges_;
  std::vector<std::size_t> others_;  ///< pieces whose boxes meet that of the present one
};

}  // namespace

std::vector<PieceExposure> exposure_of(const FlatBody& body, const std::vector<Solid>& pieces) {
  return BodyExposure(body, pieces).run();
}

}  // namespace haptic::tools
