// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/pruning/feature_cones.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tools/graph_compiler/graph/body_geometry.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"

namespace haptic::tools {
namespace {

/// A corner this far beyond a side is still on it.
constexpr double kOnSide = 1.0e-9;
/// Longer arcs [rad] are taken for all round: an arc is shorter than pi.
constexpr double kLongestArc_rad = 0.999 * std::numbers::pi;

/// {n : n.d <= rise}, one side of the directions in which no neighbour rises by epsilon.
struct RaisedSide {
  Direction d{};
  double rise = 0.0;
};

/// Appends the unit directions with n.d = rise of both sides.
void add_corners(const RaisedSide& p, const RaisedSide& q, std::vector<Direction>& to) {
  const double g = vec::dot(p.d, q.d), square = 1.0 - g * g;
  const Direction across = vec::cross(p.d, q.d);
  if (!(square > 0.0) || !(vec::norm(across) > 0.0)) return;
  const double x = (p.rise - g * q.rise) / square, y = (q.rise - g * p.rise) / square;
  const double left = 1.0 - (x * x + y * y + 2.0 * x * y * g);
  if (left < 0.0) return;  // the two never rise together
  const Direction within = vec::add(vec::scaled(p.d, x), vec::scaled(q.d, y));
  const double height = std::sqrt(left);
  for (const double sign : {height, -height}) {
    to.push_back(vec::unit(vec::add(within, vec::scaled(vec::unit(across), sign))));
  }
}

/// The angle to a cone is largest at a corner of the raised sides, or all along one of them.
double vertex_reach(const PieceShape& shape, std::uint32_t v, double epsilon_m) {
  const PieceView view = shape.topology.view();
  const SphericalPolygon& cone = shape.vertex_cones[v];
  std::vector<RaisedSide> sides;
  double reach = 0.0;
  for (const std::uint16_t e : view.edges_at(v)) {
    const Direction along = vec::sub(shape.vertices[view.other_end(e, v)], shape.vertices[v]);
    const double length = vec::norm(along);
    if (!(length > epsilon_m)) return std::numbers::pi;
    sides.push_back(
        {rotated(shape.to_cones, vec::scaled(along, 1.0 / length)), epsilon_m / length});
    reach = std::max(reach, std::asin(sides.back().rise));
  }
  std::vector<Direction> corners;
  for (std::size_t i = 0; i < sides.size(); ++i) {
    for (std::size_t k = i + 1; k < sides.size(); ++k) add_corners(sides[i], sides[k], corners);
  }
  bool any = false;
  for (const Direction& n : corners) {
    const bool is_corner = std::ranges::all_of(
        sides, [&](const RaisedSide& side) { return vec::dot(n, side.d) <= side.rise + kOnSide; });
    if (!is_corner) continue;
    any = true;
    reach = std::max(reach, angle_to(n, cone));
  }
  return any ? reach : std::numbers::pi;
}

/// Angles [rad] by which the normals of edge `e` go on beyond those of its faces; pi: all round.
std::array<double, 2> edge_reach(const PieceShape& shape, std::uint32_t e, double epsilon_m) {
  const EdgeRecord& edge = shape.topology.edges[e];
  const Direction& origin = shape.vertices[edge.vertex[0]];
  const Direction along = vec::unit(vec::sub(shape.vertices[edge.vertex[1]], origin));
  std::array<double, 2> reach{};
  for (std::size_t k = 0; k < 2; ++k) {
    const Direction apex = vec::sub(shape.vertices[edge.apex[k]], origin);
    const double width_m = vec::norm(vec::cross(along, apex));
    reach[k] = width_m > epsilon_m ? std::asin(epsilon_m / width_m) : std::numbers::pi;
  }
  return reach;
}

NearArc longer(const SphericalArc& arc, const std::array<double, 2>& by_rad) {
  const double length = angle_between(arc.from, arc.to) + by_rad[0] + by_rad[1];
  if (length > kLongestArc_rad) return {arc, true};
  const auto turned = [&](const Direction& n, double angle_rad) {
    return vec::add(vec::scaled(n, std::cos(angle_rad)),
                    vec::scaled(vec::cross(arc.pole, n), std::sin(angle_rad)));
  };
  return {{turned(arc.from, -by_rad[0]), turned(arc.to, by_rad[1]), arc.pole}, false};
}

/// -R for a piece of A, whose normals meet those of B from the other side.
Rotation inverted(const Rotation& r) {
  Rotation result = r;
  for (auto& row : result) {
    for (double& x : row) x = -x;
  }
  return result;
}

Rotation rotation_of_static(const PlacedBody& placed) {
  const auto wxyz = unit_quaternion(placed.quaternion_wxyz, placed.body.name);
  std::array<double, 4> xyzw{};
  for (std::size_t k = 0; k < 4; ++k) xyzw[k] = static_cast<double>(wxyz[(k + 1) % 4]);
  return rotation_of(xyzw);
}

/// Directions along which the edges leave a vertex.
std::vector<Direction> directions_at(const PieceShape& shape, std::uint32_t v, const Rotation& to) {
  std::vector<Direction> directions;
  const PieceView view = shape.topology.view();
  for (const std::uint16_t e : view.edges_at(v)) {
    const std::uint32_t other = view.other_end(e, v);
    directions.push_back(
        rotated(to, vec::unit(vec::sub(shape.vertices[other], shape.vertices[v]))));
  }
  return directions;
}

void add_cones(PieceShape& shape, const Rotation& to) {
  for (const Direction& n : shape.normals) shape.face_cones.push_back(rotated(to, n));
  for (const EdgeRecord& edge : shape.topology.edges) {
    shape.edge_cones.push_back(
        spherical_arc(shape.face_cones[edge.face[0]], shape.face_cones[edge.face[1]]));
  }
  for (std::uint32_t v = 0; v < shape.topology.vertex_count; ++v) {
    shape.vertex_cones.push_back(spherical_polygon(directions_at(shape, v, to)));
  }
}

void add_open_cones(PieceShape& shape, const PieceExposure* exposure, const Rotation& from_body) {
  for (std::size_t f = 0; f < shape.face_cones.size(); ++f) {
    shape.open_faces.emplace_back();
    const bool open = exposure == nullptr || !exposure->face_hidden[f];
    if (open) shape.open_faces.back().push_back(shape.face_cones[f]);
    shape.whole_faces.push_back(open &&
                                (exposure == nullptr || exposure->face_fragments[f].empty()));
  }
  for (std::size_t e = 0; e < shape.edge_cones.size(); ++e) {
    shape.open_edges.emplace_back();
    if (exposure == nullptr) {
      shape.open_edges.back().push_back(shape.edge_cones[e]);
      continue;
    }
    for (const ExposedArc& arc : exposure->edge_arcs[e]) {
      shape.open_edges.back().push_back(
          spherical_arc(rotated(from_body, arc.from), rotated(from_body, arc.to)));
    }
  }
  for (std::size_t v = 0; v < shape.vertex_cones.size(); ++v) {
    shape.open_vertices.emplace_back();
    const bool hidden = exposure != nullptr && exposure->vertex_hidden[v];
    const bool whole = !hidden && (exposure == nullptr || exposure->vertex_cone[v].empty());
    shape.whole_vertices.push_back(whole);
    if (hidden && exposure->edge_end[v]) shape.edge_ends.push_back(static_cast<std::uint32_t>(v));
    if (hidden) continue;
    if (whole) {
      shape.open_vertices.back().push_back(shape.vertex_cones[v]);
      continue;
    }
    std::vector<Direction> sides;
    for (const Direction& d : exposure->vertex_cone[v]) sides.push_back(rotated(from_body, d));
    shape.open_vertices.back().push_back(spherical_polygon(sides));
  }
}

}  // namespace

NearCones near_cones(const PieceShape& shape, double epsilon_m) {
  NearCones near;
  for (std::uint32_t v = 0; v < shape.topology.vertex_count; ++v) {
    near.vertex_reach_rad.push_back(vertex_reach(shape, v, epsilon_m));
  }
  for (std::uint32_t e = 0; e < shape.edge_cones.size(); ++e) {
    const std::array<double, 2> by_rad = edge_reach(shape, e, epsilon_m);
    near.edges.push_back(longer(shape.edge_cones[e], by_rad));
    near.open_edges.emplace_back();
    for (const SphericalArc& open : shape.open_edges[e]) {
      near.open_edges.back().push_back(longer(open, by_rad));
    }
  }
  near.open_vertices = shape.open_vertices;
  for (const std::uint32_t v : shape.edge_ends) {
    near.open_vertices[v].push_back(shape.vertex_cones[v]);
  }
  return near;
}

Rotation rotation_of(const std::array<double, 4>& xyzw) {
  const double x = xyzw[0], y = xyzw[1], z = xyzw[2], w = xyzw[3];
  return {{{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
           {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
           {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}}};
}

Direction rotated(const Rotation& r, const Direction& v) {
  Direction result{};
  for (std::size_t i = 0; i < 3; ++i) {
    result[i] = r[i][0] * v[0] + r[i][1] * v[1] + r[i][2] * v[2];
  }
  return result;
}

Rotation middle_of(const std::optional<OrientationEnvelope>& envelope) {
  return envelope ? rotation_of(envelope->about_xyzw) : rotation_of({0, 0, 0, 1});
}

double max_angle_of(const std::optional<OrientationEnvelope>& envelope) {
  return envelope && !envelope->is_free() ? envelope->max_angle_rad : std::numbers::pi;
}

std::vector<PieceShape> piece_shapes(const PlacedBody& placed, const std::array<double, 3>* grip_m,
                                     const PieceExposure* exposure,
                                     const std::optional<OrientationEnvelope>& envelope) {
  const Body& body = placed.body;
  const bool moving = grip_m != nullptr;
  const Rotation pose = moving ? rotation_of({0, 0, 0, 1}) : rotation_of_static(placed);
  const std::array<double, 3> shift =
      moving ? vec::sub(placed.mesh_origin_m, *grip_m)
             : vec::add(rotated(pose, placed.mesh_origin_m), placed.position_m);
  const Rotation to = moving ? inverted(middle_of(envelope)) : rotation_of({0, 0, 0, 1});
  std::vector<PieceShape> shapes;
  for (std::size_t i = 0; i < body.pieces.size(); ++i) {
    const ConvexPiece& piece = body.pieces[i];
    PieceShape& shape = shapes.emplace_back();
    shape.moving = moving;
    shape.topology = build_topology(body, piece, body.name + ": piece " + std::to_string(i));
    for (const auto& v : piece.vertices) {
      shape.vertices.push_back(vec::add(rotated(pose, v), shift));
    }
    for (const PieceFace& face : piece.faces) {
      shape.normals.push_back(
          rotated(pose, vec::scaled(body.planes[face.plane].normal, face.sign)));
    }
    shape.to_cones = to;
    add_cones(shape, to);
    add_open_cones(shape, exposure == nullptr ? nullptr : exposure + i, moving ? to : pose);
  }
  return shapes;
}

}  // namespace haptic::tools
