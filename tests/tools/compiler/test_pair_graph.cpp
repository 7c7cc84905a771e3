// SPDX-License-Identifier: Apache-2.0

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "tests/support/point_algebra.hpp"
#include "tests/support/shapes.hpp"
#include "tools/graph_compiler/graph/pair_graph.hpp"
#include "tools/graph_compiler/graph/piece_topology.hpp"

using namespace haptic;
using namespace haptic::test;

namespace {

// An independent view of a pair for tests: nodes, the Appendix's arcs by sets, and the facets of
// the C-obstacle by brute force over all vertices. Uses the body's doubles, never the tables under
// test.

using Pair = std::pair<std::uint32_t, std::uint32_t>;

/// Incidence of one convex piece as plain sets.
struct Incidence {
  explicit Incidence(const tools::ConvexPiece& piece);
  std::vector<Point> vertices;
  std::vector<std::vector<std::uint32_t>> faces;  ///< loops
  std::vector<Pair> edges;                        ///< (low, high), sorted
  std::vector<std::set<std::uint32_t>> face_vertices, face_edges, vertex_faces, vertex_edges;
};

/// The contact graph of two pieces by the Appendix, symmetrised: set of (node, node) with both
/// orders.
struct ReferenceGraph {
  ReferenceGraph(const Incidence& a, const Incidence& b);
  std::uint32_t node_count = 0, count_a = 0, count_b = 0;
  std::set<Pair> arcs;

 private:
  void add(std::uint32_t u, std::uint32_t v);
};

/// A facet of P(R): a node whose plane supports the C-obstacle, with the vertices (of A, of B) that
/// lie on it.
struct Facet {
  std::uint32_t node = 0;
  std::set<Pair> corners;
};

Point unit(const Point& a) {
  const double length = std::sqrt(dot(a, a));
  return {a[0] / length, a[1] / length, a[2] / length};
}

Point rotate(const std::array<double, 4>& q, const Point& v) {
  const Point u{q[1], q[2], q[3]};
  const Point t = cross(u, v);
  const Point s = cross(u, t);
  return {v[0] + 2 * (q[0] * t[0] + s[0]), v[1] + 2 * (q[0] * t[1] + s[1]),
          v[2] + 2 * (q[0] * t[2] + s[2])};
}

bool share(const std::set<std::uint32_t>& a, const std::set<std::uint32_t>& b) {
  return std::any_of(a.begin(), a.end(), [&](std::uint32_t x) { return b.contains(x); });
}

std::set<std::uint32_t> ends(const Pair& edge) { return {edge.first, edge.second}; }

Incidence::Incidence(const tools::ConvexPiece& piece) : vertices(piece.vertices) {
  std::set<Pair> all;
  for (const tools::PieceFace& face : piece.faces) {
    faces.push_back(face.loop);
    for (std::size_t k = 0; k < face.loop.size(); ++k) {
      all.insert(std::minmax(face.loop[k], face.loop[(k + 1) % face.loop.size()]));
    }
  }
  edges.assign(all.begin(), all.end());
  face_vertices.resize(faces.size());
  face_edges.resize(faces.size());
  vertex_faces.resize(vertices.size());
  vertex_edges.resize(vertices.size());
  for (std::uint32_t f = 0; f < faces.size(); ++f) {
    for (std::size_t k = 0; k < faces[f].size(); ++k) {
      const Pair ends_k = std::minmax(faces[f][k], faces[f][(k + 1) % faces[f].size()]);
      face_vertices[f].insert(faces[f][k]);
      vertex_faces[faces[f][k]].insert(f);
      const auto e = static_cast<std::uint32_t>(
          std::lower_bound(edges.begin(), edges.end(), ends_k) - edges.begin());
      face_edges[f].insert(e);
      vertex_edges[ends_k.first].insert(e);
      vertex_edges[ends_k.second].insert(e);
    }
  }
}

void ReferenceGraph::add(std::uint32_t u, std::uint32_t v) {
  arcs.insert({u, v});
  arcs.insert({v, u});
}

ReferenceGraph::ReferenceGraph(const Incidence& a, const Incidence& b) {
  const auto nfa = static_cast<std::uint32_t>(a.faces.size());
  const auto nva = static_cast<std::uint32_t>(a.vertices.size());
  const auto nea = static_cast<std::uint32_t>(a.edges.size());
  const auto nfb = static_cast<std::uint32_t>(b.faces.size());
  const auto nvb = static_cast<std::uint32_t>(b.vertices.size());
  const auto neb = static_cast<std::uint32_t>(b.edges.size());
  count_a = nfa * nvb;
  count_b = nva * nfb;
  node_count = count_a + count_b + nea * neb;
  const auto type_a = [&](std::uint32_t f, std::uint32_t v) { return f * nvb + v; };
  const auto type_b = [&](std::uint32_t v, std::uint32_t f) { return count_a + v * nfb + f; };
  const auto type_c = [&](std::uint32_t e, std::uint32_t g) {
    return count_a + count_b + e * neb + g;
  };
  for (std::uint32_t f = 0; f < nfa; ++f) {  // step 1
    for (std::uint32_t v = 0; v < nvb; ++v) {
      for (std::uint32_t other = 0; other < nfa; ++other) {
        if (other != f && share(a.face_edges[f], a.face_edges[other])) {
          add(type_a(f, v), type_a(other, v));
        }
      }
      for (std::uint32_t other = 0; other < nvb; ++other) {
        if (other != v && share(b.vertex_edges[v], b.vertex_edges[other])) {
          add(type_a(f, v), type_a(f, other));
        }
      }
      for (const std::uint32_t va : a.face_vertices[f]) {
        for (const std::uint32_t fb : b.vertex_faces[v]) add(type_a(f, v), type_b(va, fb));
      }
      for (const std::uint32_t ea : a.face_edges[f]) {
        for (const std::uint32_t eb : b.vertex_edges[v]) add(type_a(f, v), type_c(ea, eb));
      }
    }
  }
  for (std::uint32_t v = 0; v < nva; ++v) {  // step 2
    for (std::uint32_t f = 0; f < nfb; ++f) {
      for (std::uint32_t other = 0; other < nva; ++other) {
        if (other != v && share(a.vertex_edges[v], a.vertex_edges[other])) {
          add(type_b(v, f), type_b(other, f));
        }
      }
      for (std::uint32_t other = 0; other < nfb; ++other) {
        if (other != f && share(b.face_edges[f], b.face_edges[other])) {
          add(type_b(v, f), type_b(v, other));
        }
      }
      for (const std::uint32_t ea : a.vertex_edges[v]) {
        for (const std::uint32_t eb : b.face_edges[f]) add(type_b(v, f), type_c(ea, eb));
      }
    }
  }
  for (std::uint32_t e = 0; e < nea; ++e) {  // step 3
    for (std::uint32_t g = 0; g < neb; ++g) {
      for (std::uint32_t other = 0; other < neb; ++other) {
        if (other != g && share(ends(b.edges[g]), ends(b.edges[other]))) {
          add(type_c(e, g), type_c(e, other));
        }
      }
      for (std::uint32_t other = 0; other < nea; ++other) {
        if (other != e && share(ends(a.edges[e]), ends(a.edges[other]))) {
          add(type_c(e, g), type_c(other, g));
        }
      }
    }
  }
}

/// All facets at rotation `q_wxyz` of A, by comparing every node's plane with the support of all
/// vertices. Only for orientations without parallel features.
std::vector<Facet> facets_of(const tools::ConvexPiece& piece_a, const tools::ConvexPiece& piece_b,
                             const std::array<double, 4>& q_wxyz) {
  Incidence a(piece_a), b(piece_b);
  for (Point& v : a.vertices) v = rotate(q_wxyz, v);
  std::vector<Facet> facets;
  // Adds the node when no vertex of P(R) = B - R A lies beyond its plane.
  const auto consider = [&](std::uint32_t node, const Point& n, const std::set<std::uint32_t>& va,
                            const std::set<std::uint32_t>& vb) {
    double high = -1e300, low = 1e300;
    for (const Point& v : b.vertices) high = std::max(high, dot(n, v));
    for (const Point& v : a.vertices) low = std::min(low, dot(n, v));
    const double own = dot(n, b.vertices[*vb.begin()]) - dot(n, a.vertices[*va.begin()]);
    if (own < high - low - 1e-12) return;
    Facet facet;
    facet.node = node;
    for (const std::uint32_t i : va) {
      for (const std::uint32_t j : vb) facet.corners.insert({i, j});
    }
    facets.push_back(facet);
  };
  const auto normal = [](const Incidence& p, std::uint32_t f) {
    const Point& o = p.vertices[p.faces[f][0]];
    return unit(cross(minus(p.vertices[p.faces[f][1]], o), minus(p.vertices[p.faces[f][2]], o)));
  };
  const ReferenceGraph numbers(a, b);
  std::uint32_t node = 0;
  for (std::uint32_t f = 0; f < a.faces.size(); ++f) {
    const Point n = normal(a, f);
    for (std::uint32_t v = 0; v < b.vertices.size(); ++v, ++node) {
      consider(node, {-n[0], -n[1], -n[2]}, a.face_vertices[f], {v});
    }
  }
  for (std::uint32_t v = 0; v < a.vertices.size(); ++v) {
    for (std::uint32_t f = 0; f < b.faces.size(); ++f, ++node) {
      consider(node, normal(b, f), {v}, b.face_vertices[f]);
    }
  }
  for (const Pair& e : a.edges) {
    for (const Pair& g : b.edges) {
      const Point n = unit(cross(minus(a.vertices[e.second], a.vertices[e.first]),
                                 minus(b.vertices[g.second], b.vertices[g.first])));
      consider(node, n, ends(e), ends(g));
      consider(node, {-n[0], -n[1], -n[2]}, ends(e), ends(g));
      ++node;
    }
  }
  return facets;
}

struct Graph {
  Graph(const tools::Body& body_a, const tools::Body& body_b)
      : a(tools::build_topology(body_a, body_a.pieces[0], "a")),
        b(tools::build_topology(body_b, body_b.pieces[0], "b")),
        graph(tools::build_pair_graph(a.view(), b.view())) {}
  [[nodiscard]] std::uint32_t degree(std::uint32_t node) const {
    return graph.neighbor_begin[node + 1] - graph.neighbor_begin[node];
  }
  [[nodiscard]] std::size_t type(std::uint32_t node) const {
    return node < graph.node_count_a ? 0 : node < graph.node_count_a + graph.node_count_b ? 1 : 2;
  }
  tools::PieceTopology a, b;
  tools::PairGraph graph;
};

tools::Body tetra() {
  return tetrahedron({0, 0, 0}, {0.1, 0, 0.01}, {0.02, 0.1, 0}, {0, 0.03, 0.1});
}
tools::Body cube() { return box({-0.05, -0.04, -0.03}, {0.05, 0.04, 0.03}); }

/// Square pyramid: vertices of degree 3 and 4, faces of 3 and 4 edges.
tools::Body pyramid() {
  return convex_body({{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}, {0.1, 0.2, 1}},
                     {{0, 3, 2, 1}, {0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}});
}

struct Shapes {
  const char* name;
  tools::Body a, b;
};
std::vector<Shapes> pairs_of_shapes() {
  return {{"tetrahedron, box", tetra(), cube()},
          {"box, box", cube(), box({0, 0, 0}, {1, 2, 3})},
          {"pyramid, tetrahedron", pyramid(), tetra()},
          {"box, pyramid", cube(), pyramid()},
          {"7-prism, pyramid", prism(7, 0.05, 0.1), pyramid()}};
}

}  // namespace

TEST_SUITE("tools.pair_graph") {
  TEST_CASE("counts and degrees are those of the published pairs") {
    const Graph paper(tetra(), cube());
    CHECK(paper.graph.nodes.size() == 128);
    CHECK(paper.graph.node_count_a == 32);
    CHECK(paper.graph.node_count_b == 24);
    CHECK(paper.graph.neighbors.size() == 2 * 1332);
    constexpr std::uint32_t kDegrees[3] = {24, 31, 16};
    for (std::uint32_t node = 0; node < 128; ++node) {
      REQUIRE(paper.degree(node) == kDegrees[paper.type(node)]);
    }
    const Graph boxes(cube(), cube());
    CHECK(boxes.graph.nodes.size() == 240);
    CHECK(boxes.graph.max_degree == 31);
    const Graph prism_box(prism(12, 0.05, 0.1), cube());
    CHECK(prism_box.graph.nodes.size() == 688);
    CHECK(prism_box.graph.max_degree == 87);
  }

  TEST_CASE("lists are the Appendix's arcs both ways, ascending, without repeats") {
    for (const Shapes& shapes : pairs_of_shapes()) {
      CAPTURE(shapes.name);
      const Graph g(shapes.a, shapes.b);
      const ReferenceGraph reference(Incidence(shapes.a.pieces[0]), Incidence(shapes.b.pieces[0]));
      REQUIRE(g.graph.nodes.size() == reference.node_count);
      std::vector<Pair> arcs;
      for (std::uint32_t node = 0; node < reference.node_count; ++node) {
        for (std::uint32_t k = g.graph.neighbor_begin[node]; k < g.graph.neighbor_begin[node + 1];
             ++k) {
          arcs.emplace_back(node, g.graph.neighbors[k]);
        }
      }
      // A set iterates in ascending order, so equality also proves order and absence of repeats.
      CHECK(arcs == std::vector<Pair>(reference.arcs.begin(), reference.arcs.end()));
      const tools::GraphSize size = tools::graph_size(g.a.view(), g.b.view());
      CHECK(size.nodes == g.graph.nodes.size());
      CHECK(size.neighbor_entries == g.graph.neighbors.size());
    }
  }

  TEST_CASE(
      "facets of the C-obstacle that share an edge are joined by an arc, at any orientation") {
    Random random(20240611);
    std::size_t orientations = 0, shared_edges = 0;
    for (const Shapes& shapes : pairs_of_shapes()) {
      CAPTURE(shapes.name);
      const Graph g(shapes.a, shapes.b);
      for (int i = 0; i < 40; ++i) {
        const std::vector<Facet> facets =
            facets_of(shapes.a.pieces[0], shapes.b.pieces[0], random.rotation());
        if (std::string_view(shapes.name) == "tetrahedron, box") {
          CHECK(facets.size() >= 19);
          CHECK(facets.size() <= 22);
        }
        std::size_t boundary = 0;
        for (std::size_t u = 0; u < facets.size(); ++u) {
          for (std::size_t v = u + 1; v < facets.size(); ++v) {
            std::vector<Pair> common;
            std::set_intersection(facets[u].corners.begin(), facets[u].corners.end(),
                                  facets[v].corners.begin(), facets[v].corners.end(),
                                  std::back_inserter(common));
            if (common.size() < 2) continue;
            ++boundary;
            const auto* list = g.graph.neighbors.data();
            REQUIRE(std::binary_search(list + g.graph.neighbor_begin[facets[u].node],
                                       list + g.graph.neighbor_begin[facets[u].node + 1],
                                       facets[v].node));
          }
        }
        // Euler on the C-obstacle: the facets found are all of them.
        std::set<Pair> corners;
        for (const Facet& facet : facets)
          corners.insert(facet.corners.begin(), facet.corners.end());
        REQUIRE(corners.size() + facets.size() == boundary + 2);
        ++orientations;
        shared_edges += boundary;
      }
    }
    MESSAGE(orientations << " orientations, " << shared_edges << " shared edges");
  }
}
