// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <map>

#include "tests/support/shapes.hpp"
#include "tests/tools/compiler/contact_facets.hpp"
#include "tools/graph_compiler/graph/pair_graph.hpp"
#include "tools/graph_compiler/graph/piece_topology.hpp"

using namespace haptic;
using namespace haptic::test;

namespace {

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
