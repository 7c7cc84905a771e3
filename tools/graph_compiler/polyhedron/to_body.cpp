// SPDX-License-Identifier: Apache-2.0
/// Exact pieces to doubles: the only rounding between the cleaned part and the scene.
#include <algorithm>
#include <limits>
#include <map>
#include <stdexcept>

#include "tools/graph_compiler/polyhedron/decomposition.hpp"
#include "tools/graph_compiler/polyhedron/measure.hpp"

namespace haptic::tools {

namespace {

// file = local / scale + centre, exact.
struct FileFrame {
  Rational scale;
  Rational3 centre;

  explicit FileFrame(const ExactWorld& world)
      : scale(world.scale),
        centre{Rational(world.centre_m[0]), Rational(world.centre_m[1]),
               Rational(world.centre_m[2])} {}

  [[nodiscard]] std::array<double, 3> point(const Rational3& x) const {
    std::array<double, 3> result;
    for (std::size_t i = 0; i < 3; ++i) result[i] = to_double(x[i] / scale + centre[i]);
    return result;
  }
};

// n.x = d in the local frame is n.(file - centre) = d / scale. Each number is rounded once.
BodyPlane rounded_plane(const ExactPlane& plane, const FileFrame& frame) {
  const Rational square = dot(plane.n, plane.n);
  BodyPlane result;
  for (std::size_t i = 0; i < 3; ++i) result.normal[i] = over_root(plane.n[i], square);
  result.offset_m = over_root(plane.d / frame.scale + dot(plane.n, frame.centre), square);
  return result;
}

ConvexPiece rounded_piece(ExactWorld& world, const Solid& piece, const FileFrame& frame,
                          const std::map<std::uint32_t, std::uint32_t>& plane_index) {
  ConvexPiece result;
  const std::vector<std::uint32_t> vertices = vertices_of(piece);
  for (const std::uint32_t v : vertices) {
    result.vertices.push_back(frame.point(world.vertices[v].x));
    result.source_vertex.push_back(world.source_vertex[v]);
  }
  for (const ExactFace& face : piece.faces) {
    const std::vector<Loop> loops = trace_loops(world, face);
    if (loops.size() != 1)
      throw std::logic_error("to_body: a facet of a convex piece has one loop");
    PieceFace rounded;
    rounded.plane = plane_index.at(face.plane);
    rounded.sign = face.sign;
    rounded.source_face = face.source_face;
    for (const std::uint32_t v : loops.front()) {
      const auto it = std::lower_bound(vertices.begin(), vertices.end(), v);
      rounded.loop.push_back(static_cast<std::uint32_t>(it - vertices.begin()));
    }
    result.faces.push_back(std::move(rounded));
  }
  return result;
}

}  // namespace

Body to_body(const FlatBody& body, const Decomposition& decomposition, const std::string& name,
             std::vector<std::size_t>* order) {
  // Tracing loops counts work; the caller's world stays as it is.
  ExactWorld world = body.world;
  world.work_limit = std::numeric_limits<double>::infinity();
  const FileFrame frame(world);
  Body result;
  result.name = name;

  std::map<std::uint32_t, std::uint32_t> plane_index;
  for (const Solid& piece : decomposition.pieces) {
    for (const ExactFace& face : piece.faces) plane_index.emplace(face.plane, 0);
  }
  for (auto& [plane, index] : plane_index) {
    index = static_cast<std::uint32_t>(result.planes.size());
    result.planes.push_back(rounded_plane(world.planes[plane], frame));
  }

  // Pieces by their rounded centre of volume; equal centres keep the order of the decomposition.
  const Rational cubic = frame.scale * frame.scale * frame.scale;
  Rational volume = 0;
  Rational3 moment{0, 0, 0};
  struct CentredPiece {
    std::array<double, 3> centre;
    std::size_t index;
    ConvexPiece piece;
  };
  std::vector<CentredPiece> sorted;
  for (const Solid& piece : decomposition.pieces) {
    const Measure m = measure(world, piece);
    volume += m.volume;
    for (std::size_t i = 0; i < 3; ++i) moment[i] += m.first_moment[i];
    Rational3 centre;
    for (std::size_t i = 0; i < 3; ++i) centre[i] = m.first_moment[i] / m.volume;
    ConvexPiece rounded = rounded_piece(world, piece, frame, plane_index);
    rounded.volume_m3 = to_double(m.volume / cubic);
    sorted.push_back({frame.point(centre), sorted.size(), std::move(rounded)});
  }
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const auto& a, const auto& b) { return a.centre < b.centre; });
  for (CentredPiece& centred : sorted) {
    result.pieces.push_back(std::move(centred.piece));
    if (order != nullptr) order->push_back(centred.index);
  }

  result.volume_m3 = to_double(volume / cubic);
  Rational3 centre;
  for (std::size_t i = 0; i < 3; ++i) centre[i] = moment[i] / volume;
  result.centre_of_volume_m = frame.point(centre);
  return result;
}

}  // namespace haptic::tools
