// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/pruning/feature_cones.hpp"

#include "tools/graph_compiler/graph/body_geometry.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"

namespace haptic::tools {
namespace {

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
