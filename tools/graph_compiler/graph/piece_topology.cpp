// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/graph/piece_topology.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>

#include "tools/common/error.hpp"
#include "tools/graph_compiler/graph/wide3.hpp"

namespace haptic::tools {
namespace {

/// One side of an edge: the face that walks it, forward (low to high vertex) or not.
struct HalfEdge {
  std::uint32_t low, high;
  bool backward;
  std::uint32_t face;
};

[[noreturn]] void refuse(const std::string& place, const std::string& defect) {
  throw InputError(place + ": " + defect + "; the pieces must be closed convex polyhedra");
}

std::uint16_t narrow(std::uint32_t index) { return static_cast<std::uint16_t>(index); }

void check_counts(const ConvexPiece& piece, const std::string& place) {
  const auto limited = [&](std::size_t count, const char* what,
                           std::size_t limit = kMaxPieceFeatures) {
    if (count > limit) {
      throw InputError(place + ": " + std::to_string(count) + " " + what + ", the format holds " +
                       std::to_string(limit) + "; use a coarser mesh");
    }
  };
  std::size_t corners = 0;
  for (const PieceFace& face : piece.faces) {
    limited(face.loop.size(), "vertices round one face", kMaxFaceVertices);
    corners += face.loop.size();
  }
  limited(piece.vertices.size(), "vertices");
  limited(piece.faces.size(), "faces");
  limited(corners / 2, "edges");
  if (!piece.is_facet() && (piece.vertices.size() < 4 || piece.faces.size() < 4)) {
    refuse(place, std::to_string(piece.vertices.size()) + " vertices and " +
                      std::to_string(piece.faces.size()) + " faces do not bound a solid");
  }
  if (!piece.source_vertex.empty() && piece.source_vertex.size() != piece.vertices.size()) {
    refuse(place, "its table of source vertices has " + std::to_string(piece.source_vertex.size()) +
                      " entries for " + std::to_string(piece.vertices.size()) + " vertices");
  }
}

void check_face(const Body& body, const ConvexPiece& piece, std::size_t f,
                const std::string& place) {
  const PieceFace& face = piece.faces[f];
  const std::string name = "face " + std::to_string(f);
  if (face.loop.size() < 3) refuse(place, name + " has fewer than three vertices");
  if (face.plane >= body.planes.size()) {
    refuse(place, name + " names plane " + std::to_string(face.plane) + " of " +
                      std::to_string(body.planes.size()));
  }
  if (face.sign != 1 && face.sign != -1) refuse(place, name + " has a sign that is not +1 or -1");
  if (face.source_face < -1 || face.source_face > std::numeric_limits<std::int32_t>::max()) {
    refuse(place, name + " names a source face out of range");
  }
  std::vector<std::uint32_t> sorted = face.loop;
  std::sort(sorted.begin(), sorted.end());
  if (sorted.back() >= piece.vertices.size()) {
    refuse(place, name + " names vertex " + std::to_string(sorted.back()) + " of " +
                      std::to_string(piece.vertices.size()));
  }
  if (std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end()) {
    refuse(place, name + " visits a vertex twice");
  }
}

std::vector<HalfEdge> half_edges_of(const ConvexPiece& piece) {
  std::vector<HalfEdge> halves;
  for (std::uint32_t f = 0; f < piece.faces.size(); ++f) {
    const std::vector<std::uint32_t>& loop = piece.faces[f].loop;
    for (std::size_t k = 0; k < loop.size(); ++k) {
      const std::uint32_t u = loop[k], v = loop[k + 1 == loop.size() ? 0 : k + 1];
      halves.push_back({std::min(u, v), std::max(u, v), u > v, f});
    }
  }
  std::sort(halves.begin(), halves.end(), [](const HalfEdge& a, const HalfEdge& b) {
    return std::tie(a.low, a.high, a.backward, a.face) <
           std::tie(b.low, b.high, b.backward, b.face);
  });
  return halves;
}

/// Pairs the halves: face[0] walks v0 -> v1, face[1] back.
std::vector<EdgeRecord> pair_halves(const std::vector<HalfEdge>& halves, const std::string& place) {
  std::vector<EdgeRecord> edges;
  for (std::size_t i = 0; i < halves.size();) {
    std::size_t end = i;
    while (end < halves.size() && halves[end].low == halves[i].low &&
           halves[end].high == halves[i].high) {
      ++end;
    }
    if (end - i != 2 || halves[i].backward || !halves[i + 1].backward) {
      refuse(place, "the edge between vertices " + std::to_string(halves[i].low) + " and " +
                        std::to_string(halves[i].high) + " is not walked once in each direction (" +
                        std::to_string(end - i) + " faces)");
    }
    EdgeRecord edge{};
    edge.vertex[0] = narrow(halves[i].low);
    edge.vertex[1] = narrow(halves[i].high);
    edge.face[0] = narrow(halves[i].face);
    edge.face[1] = narrow(halves[i + 1].face);
    edges.push_back(edge);
    i = end;
  }
  return edges;
}

Wide3 minus(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  Wide3 result{};
  for (std::size_t k = 0; k < 3; ++k) {
    result[k] = static_cast<long double>(a[k]) - static_cast<long double>(b[k]);
  }
  return result;
}

/// Vertex of `face` farthest from the line of the edge: its height over a contact plane tells on
/// which side of the plane the face leaves the edge with the best conditioning (rt_core/METHOD.md
/// section 2, type C). First of equals in the loop.
std::uint16_t farthest_from_edge(const ConvexPiece& piece, std::uint32_t face,
                                 const EdgeRecord& edge) {
  const auto& origin = piece.vertices[edge.vertex[0]];
  const Wide3 along = minus(piece.vertices[edge.vertex[1]], origin);
  long double largest = 0.0L;
  std::uint32_t apex = piece.faces[face].loop.front();
  for (const std::uint32_t v : piece.faces[face].loop) {
    const Wide3 c = cross(along, minus(piece.vertices[v], origin));
    const long double square = c[0] * c[0] + c[1] * c[1] + c[2] * c[2];
    if (square > largest) {
      largest = square;
      apex = v;
    }
  }
  return narrow(apex);
}

void fill_vertex_edges(PieceTopology& t) {
  t.vertex_edge_begin.assign(t.vertex_count + 1, 0);
  for (const EdgeRecord& edge : t.edges) {
    for (const std::uint16_t v : edge.vertex) ++t.vertex_edge_begin[v + 1u];
  }
  for (std::uint32_t v = 0; v < t.vertex_count; ++v) {
    t.vertex_edge_begin[v + 1] += t.vertex_edge_begin[v];
  }
  std::vector<std::uint32_t> next(t.vertex_edge_begin.begin(), t.vertex_edge_begin.end() - 1);
  t.vertex_edges.resize(2 * t.edges.size());
  for (std::uint32_t e = 0; e < t.edges.size(); ++e) {
    for (const std::uint16_t v : t.edges[e].vertex) t.vertex_edges[next[v]++] = narrow(e);
  }
}

void fill_loops(const ConvexPiece& piece, PieceTopology& t) {
  for (const PieceFace& face : piece.faces) {
    FaceRecord record{};
    record.plane = face.plane;
    record.sign = face.sign;
    record.loop_begin = static_cast<std::uint32_t>(t.loop_vertices.size());
    record.loop_count = static_cast<std::uint32_t>(face.loop.size());
    record.source_face = static_cast<std::int32_t>(face.source_face);
    t.faces.push_back(record);
    for (std::size_t k = 0; k < face.loop.size(); ++k) {
      const std::uint32_t u = face.loop[k], v = face.loop[k + 1 == face.loop.size() ? 0 : k + 1];
      const std::pair<std::uint32_t, std::uint32_t> ends = std::minmax(u, v);
      const auto at = std::lower_bound(
          t.edges.begin(), t.edges.end(), ends, [](const EdgeRecord& edge, const auto& key) {
            return std::pair<std::uint32_t, std::uint32_t>(edge.vertex[0], edge.vertex[1]) < key;
          });
      t.loop_vertices.push_back(narrow(u));
      t.loop_edges.push_back(static_cast<std::uint16_t>(at - t.edges.begin()));
    }
  }
}

/// A closed surface with V - E + F = 2 could still be a sphere next to a torus: one component
/// settles it.
void check_sphere(const PieceTopology& t, const std::string& place) {
  for (std::uint32_t v = 0; v < t.vertex_count; ++v) {
    const std::uint32_t degree = t.vertex_edge_begin[v + 1] - t.vertex_edge_begin[v];
    if (degree < (t.faces.size() == 2 ? 2u : 3u)) {
      refuse(place, "vertex " + std::to_string(v) + " has " + std::to_string(degree) + " edges");
    }
  }
  if (t.vertex_count + t.faces.size() != t.edges.size() + 2) {
    refuse(place, std::to_string(t.vertex_count) + " vertices, " + std::to_string(t.edges.size()) +
                      " edges and " + std::to_string(t.faces.size()) +
                      " faces do not satisfy V - E + F = 2");
  }
  std::vector<bool> reached(t.vertex_count, false);
  std::vector<std::uint32_t> open{0};
  reached[0] = true;
  std::size_t count = 1;
  while (!open.empty()) {
    const std::uint32_t v = open.back();
    open.pop_back();
    for (std::uint32_t i = t.vertex_edge_begin[v]; i < t.vertex_edge_begin[v + 1]; ++i) {
      for (const std::uint16_t w : t.edges[t.vertex_edges[i]].vertex) {
        if (reached[w]) continue;
        reached[w] = true;
        ++count;
        open.push_back(w);
      }
    }
  }
  if (count != t.vertex_count) refuse(place, "its surface falls into several parts");
}

}  // namespace

PieceTopology build_topology(const Body& body, const ConvexPiece& piece, const std::string& place) {
  check_counts(piece, place);
  for (std::size_t f = 0; f < piece.faces.size(); ++f) check_face(body, piece, f, place);
  PieceTopology t;
  t.vertex_count = static_cast<std::uint32_t>(piece.vertices.size());
  t.edges = pair_halves(half_edges_of(piece), place);
  for (EdgeRecord& edge : t.edges) {
    for (int k = 0; k < 2; ++k) edge.apex[k] = farthest_from_edge(piece, edge.face[k], edge);
  }
  fill_vertex_edges(t);
  fill_loops(piece, t);
  check_sphere(t, place);
  return t;
}

PieceView PieceTopology::view() const {
  PieceView v;
  v.faces = faces.data();
  v.edges = edges.data();
  v.vertex_edge_begin = vertex_edge_begin.data();
  v.vertex_edges = vertex_edges.data();
  v.loop_vertices = loop_vertices.data();
  v.loop_edges = loop_edges.data();
  v.vertex_count = vertex_count;
  v.face_count = static_cast<std::uint32_t>(faces.size());
  v.edge_count = static_cast<std::uint32_t>(edges.size());
  return v;
}

}  // namespace haptic::tools
