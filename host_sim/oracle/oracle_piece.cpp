// SPDX-License-Identifier: Apache-2.0
#include "host_sim/oracle/oracle_piece.hpp"

#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

std::uint32_t farthest_from_line(const std::vector<WideVec>& vertices,
                                 const std::vector<std::uint32_t>& loop, std::uint32_t v0,
                                 std::uint32_t v1) {
  const WideVec axis = unit(vertices[v1] - vertices[v0]);
  std::uint32_t best = loop.front();
  Wide best_distance = -1;
  for (const std::uint32_t v : loop) {
    const Wide distance = norm(cross(axis, vertices[v] - vertices[v0]));
    if (distance > best_distance) {
      best_distance = distance;
      best = v;
    }
  }
  return best;
}

}  // namespace

WideVec polygon_normal(const std::vector<WideVec>& vertices,
                       const std::vector<std::uint32_t>& loop) {
  WideVec sum;
  const WideVec origin = vertices[loop.front()];
  for (std::size_t k = 1; k + 1 < loop.size(); ++k) {
    sum = sum + cross(vertices[loop[k]] - origin, vertices[loop[k + 1]] - origin);
  }
  return unit(sum);
}

Wide diameter(const std::vector<WideVec>& points) {
  Wide largest = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t j = i + 1; j < points.size(); ++j) {
      const WideVec d = points[i] - points[j];
      largest = std::max(largest, dot(d, d));
    }
  }
  return std::sqrt(largest);
}

OraclePiece make_oracle_piece(std::vector<WideVec> vertices,
                              std::vector<std::vector<std::uint32_t>> loops,
                              std::vector<WideVec> normals) {
  OraclePiece piece;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<std::uint32_t>> faces_of_edge;
  for (std::size_t f = 0; f < loops.size(); ++f) {
    const auto& loop = loops[f];
    for (std::size_t k = 0; k < loop.size(); ++k) {
      const std::uint32_t from = loop[k], to = loop[(k + 1) % loop.size()];
      if (loop.size() < 3 || from >= vertices.size() || to >= vertices.size()) {
        throw tools::InputError(
            "face " + std::to_string(f) +
            " names a vertex that does not exist or has fewer than three; fix its loop");
      }
      faces_of_edge[std::minmax(from, to)].push_back(static_cast<std::uint32_t>(f));
    }
  }
  piece.vertex_neighbors.resize(vertices.size());
  for (const auto& [ends, faces] : faces_of_edge) {  // std::map: lexicographic order
    if (faces.size() != 2) {
      throw tools::InputError("edge (" + std::to_string(ends.first) + ", " +
                              std::to_string(ends.second) + ") belongs to " +
                              std::to_string(faces.size()) +
                              " faces instead of two; close the surface");
    }
    OracleEdge edge;
    edge.vertex[0] = ends.first;
    edge.vertex[1] = ends.second;
    for (int k = 0; k < 2; ++k) {
      edge.face[k] = faces[static_cast<std::size_t>(k)];
      edge.apex[k] = farthest_from_line(vertices, loops[edge.face[k]], ends.first, ends.second);
    }
    piece.edges.push_back(edge);
    piece.vertex_neighbors[ends.first].push_back(ends.second);
    piece.vertex_neighbors[ends.second].push_back(ends.first);
  }
  for (auto& list : piece.vertex_neighbors) std::sort(list.begin(), list.end());
  if (normals.empty()) {
    for (const auto& loop : loops) normals.push_back(polygon_normal(vertices, loop));
  }
  piece.vertices = std::move(vertices);
  piece.loops = std::move(loops);
  piece.normals = std::move(normals);
  return piece;
}

OraclePiece oracle_piece_of(const PieceView& view) {
  std::vector<WideVec> vertices;
  for (std::uint32_t v = 0; v < view.vertex_count; ++v) {
    const Real* p = view.vertices + 3 * std::size_t{v};
    vertices.push_back({widen(p[0]), widen(p[1]), widen(p[2])});
  }
  std::vector<std::vector<std::uint32_t>> loops;
  std::vector<WideVec> normals;
  for (std::uint32_t f = 0; f < view.face_count; ++f) {
    const auto loop = view.face_vertices(f);
    loops.emplace_back(loop.begin(), loop.end());
    const FaceRecord& face = view.faces[f];
    const PlaneRecord& plane = view.planes[face.plane];
    const WideVec n{widen(plane.normal[0]), widen(plane.normal[1]), widen(plane.normal[2])};
    normals.push_back(static_cast<Wide>(face.sign) * unit(n));
  }
  return make_oracle_piece(std::move(vertices), std::move(loops), std::move(normals));
}

}  // namespace haptic::sim
