// SPDX-License-Identifier: Apache-2.0
// Arcs and relaxations against what they promise: closed forms, then random directions.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/shapes.hpp"
#include "tools/graph_compiler/graph/relaxation.hpp"

using namespace haptic;
using namespace haptic::test;
using namespace haptic::tools;

namespace {

/// Margin that an arc has for the rounding of its half angle [rad].
constexpr double kMargin_rad = HAPTIC_REAL_IS_FLOAT ? 2e-6 : 4e-15;

/// Rounding of the vertices of the pieces below, of 0.2 m at most [m], and as a share.
constexpr double kVertexShare = 16 * static_cast<double>(kRealEpsilon);
constexpr double kVertexRounding_m = 0.2 * kVertexShare;

/// The one piece of a body, as the writer sees it.
struct PieceUnderTest {
  explicit PieceUnderTest(const tools::Body& body)
      : topology(tools::build_topology(body, body.pieces[0], "test")),
        geometry(tools::moving_geometry({body, {0, 0, 0}, {1, 0, 0, 0}, {0, 0, 0}}, {0, 0, 0},
                                        {topology})),
        wide(topology, geometry, 0) {}

  [[nodiscard]] std::vector<tools::WideArc> arcs(double epsilon_m) const {
    std::vector<tools::WideArc> result;
    for (std::uint32_t e = 0; e < topology.edges.size(); ++e) {
      result.push_back(tools::wide_arc(wide, e, epsilon_m));
    }
    return result;
  }
  [[nodiscard]] double edge_ratio(double epsilon_m) const {
    return tools::edge_relaxation(wide, arcs(epsilon_m), epsilon_m, geometry.pieces[0].radius_m)
        .ratio;
  }
  [[nodiscard]] double vertex_relax_m(double epsilon_m) const {
    return tools::vertex_relaxation(wide, epsilon_m).relax_m;
  }
  /// Largest height of a neighbor of vertex v over the plane through it across n.
  [[nodiscard]] Wide neighbor_rise(const Wide3& n, std::uint32_t v) const {
    Wide largest = 0;
    for (std::uint32_t i = topology.vertex_edge_begin[v]; i < topology.vertex_edge_begin[v + 1];
         ++i) {
      const EdgeRecord& edge = topology.edges[topology.vertex_edges[i]];
      const std::uint16_t neighbor = edge.vertex[edge.vertex[0] == v ? 1 : 0];
      largest = std::max(largest, dot(n, wide.vertices[neighbor] - wide.vertices[v]));
    }
    return largest;
  }
  /// Largest height of a vertex over the plane through `origin` across n.
  [[nodiscard]] Wide rise(const Wide3& n, const Wide3& origin) const {
    Wide largest = 0;
    for (const Wide3& v : wide.vertices) largest = std::max(largest, dot(n, v - origin));
    return largest;
  }

  tools::PieceTopology topology;
  tools::BodyGeometry geometry;
  tools::WidePiece wide;
};

Wide3 random_unit(Random& random) {
  for (;;) {
    const Wide3 n{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
    const Wide length = norm(n);
    if (length > 0.1L && length < 1) return (1 / length) * n;
  }
}

/// Directions near those that matter: within some angle of a face's normal.
Wide3 direction_near(const PieceUnderTest& piece, Random& random, Wide angle) {
  const auto f = random.next() % piece.wide.normals.size();
  return tools::unit(piece.wide.normals[f] + angle * random_unit(random));
}

/// 100 000 seeded directions n: the bound of vertex relaxation, edge by edge and vertex by vertex.
void check_sampled(const tools::Body& body, double epsilon_m, std::uint64_t seed) {
  CAPTURE(seed);
  const PieceUnderTest piece(body);
  const std::vector<tools::WideArc> arcs = piece.arcs(epsilon_m);
  const Wide ratio = static_cast<Wide>(piece.edge_ratio(epsilon_m));
  const Wide relax = static_cast<Wide>(piece.vertex_relax_m(epsilon_m));
  const Wide epsilon = static_cast<Wide>(epsilon_m);
  std::vector<VertexRise> rises;
  for (std::uint32_t v = 0; v < piece.topology.vertex_count; ++v) rises.emplace_back(piece.wide, v);
  const Wide at_epsilon_slack = 1 + 1e-12L;
  Random random(seed);
  std::size_t vertex_cases = 0, edge_cases = 0, full_cases = 0, failures = 0;
  const auto test_vertex = [&](std::uint32_t v, const Wide3& n) {
    const Wide3& b = piece.wide.vertices[v];
    const Wide t = piece.neighbor_rise(n, v);
    if (t > epsilon) return;
    vertex_cases += 1;
    const Wide rise = piece.rise(n, b);
    // g costs more than a sample: asked only now and then.
    if (vertex_cases % 64 == 0 && rise > rises[v].largest(t) * at_epsilon_slack + 1e-15L) {
      failures += 1;
    }
    if (epsilon + rise - t > relax) failures += 1;
  };
  const auto test_edge = [&](std::uint32_t e, Wide share) {
    const tools::WideArc& arc = arcs[e];
    const Wide angle = share * std::atan2(arc.sine, arc.cosine);
    const Wide3 n = std::cos(angle) * arc.mid + std::sin(angle) * arc.side;
    const EdgeRecord& edge = piece.topology.edges[e];
    const Wide3& origin = piece.wide.vertices[edge.vertex[0]];
    Wide face_rise = 0;
    for (const std::uint16_t apex : edge.apex) {
      face_rise = std::max(face_rise, dot(n, piece.wide.vertices[apex] - origin));
    }
    edge_cases += 1;
    const Wide beyond = epsilon + static_cast<Wide>(0.2 * kMargin_rad + kVertexRounding_m);
    if (arc.full) {  // bounded by ratio times epsilon alone
      full_cases += 1;
      if (piece.rise(n, origin) > ratio * epsilon) failures += 1;
      return;
    }
    if (face_rise > beyond) failures += 1;
    if (piece.rise(n, origin) > ratio * (face_rise + static_cast<Wide>(kVertexRounding_m))) {
      failures += 1;
    }
  };
  for (int k = 0; k < 100000; ++k) {
    const Wide angle = std::pow(Wide{10}, -4 * static_cast<Wide>(random.uniform(0, 1)));
    const Wide3 n = direction_near(piece, random, angle);
    for (std::uint32_t v = 0; v < piece.topology.vertex_count; ++v) test_vertex(v, n);
    test_edge(static_cast<std::uint32_t>(random.next() % arcs.size()), random.uniform(-1, 1));
  }
  CHECK(failures == 0);
  CHECK(vertex_cases > 1000);
  CHECK(edge_cases == 100000);
  CHECK(full_cases < edge_cases);
}

}  // namespace

TEST_SUITE("tools.relaxation") {
  TEST_CASE("box: an edge's face rises with the piece, a face's far corner by two epsilon") {
    const PieceUnderTest piece(box({-0.05, -0.05, -0.05}, {0.05, 0.05, 0.05}));
    const double epsilon = 1e-4;
    const double ratio = piece.edge_ratio(epsilon);
    CHECK(ratio >= 1.0);
    CHECK(ratio <= 1.0 + 1e-8 + 1.01 * kMargin_rad * 0.1 / epsilon);
    const VertexRise corner(piece.wide, 0);
    CHECK(static_cast<double>(corner.largest(1e-4L)) == doctest::Approx(2e-4).epsilon(1e-12));
    CHECK(static_cast<double>(corner.depth_m()) == doctest::Approx(0.1 / std::sqrt(3.0)));
    CHECK(piece.vertex_relax_m(epsilon) ==
          doctest::Approx(epsilon * (1 + 2 - 15.0 / 16)).epsilon(1e-8));
  }

  TEST_CASE("box: arcs span a right angle and the two extensions") {
    const double epsilon = 1e-3, side = 0.1;
    const PieceUnderTest piece(box({0, 0, 0}, {side, side, side}));
    for (const tools::WideArc& arc : piece.arcs(epsilon)) {
      const double half = static_cast<double>(std::atan2(arc.sine, arc.cosine));
      CHECK(half == doctest::Approx(std::acos(-1.0) / 4 + std::asin(epsilon / side)));
      CHECK(static_cast<double>(arc.width_m[0]) == doctest::Approx(side));
    }
    // Wider than the box: no face can rise by epsilon, regardless of the turn.
    for (const tools::WideArc& arc : piece.arcs(1.0)) {
      CHECK(arc.full);
      CHECK(arc.cosine == -1);
      CHECK(arc.sine == 0);
    }
  }

  TEST_CASE(
      "unequal faces: the extended arc is symmetric about its middle and holds both normals") {
    const PieceUnderTest piece(box({0, 0, 0}, {0.1, 0.01, 0.001}));
    const double epsilon = 2e-3;
    const std::vector<tools::WideArc> arcs = piece.arcs(epsilon);
    std::size_t partial = 0;
    for (std::uint32_t e = 0; e < arcs.size(); ++e) {
      CHECK(arcs[e].full == (std::min(arcs[e].width_m[0], arcs[e].width_m[1]) < 2e-3L));
      if (arcs[e].full) continue;
      ++partial;
      for (int k = 0; k < 2; ++k) {
        const Wide3 n = piece.wide.normals[piece.topology.edges[e].face[k]];
        const Wide3 end = arcs[e].end(k);
        const Wide sine = std::min<Wide>(1, static_cast<Wide>(epsilon) / arcs[e].width_m[k]);
        const Wide turn = std::acos(dot(n, end));
        const double needed = static_cast<double>(std::asin(sine));
        CHECK(static_cast<double>(turn) >= needed - 1e-9);
        CHECK(static_cast<double>(turn) <= needed + 1.01 * kMargin_rad + 1e-9);
        CHECK(dot(n, arcs[e].mid) >= arcs[e].cosine);
        CHECK(static_cast<double>(dot(arcs[e].mid, arcs[e].side)) == doctest::Approx(0.0));
      }
    }
    CHECK(partial == 4);  // only across the shortest edges are both faces wide
  }

  TEST_CASE("a stored arc holds the exact one, however flat") {
    for (const double epsilon : {1e-9, 1e-6, 1e-4}) {
      const PieceUnderTest piece(random_hull(21, 40, {0.05, 0.05, 0.0005}));
      const std::vector<WideArc> arcs = piece.arcs(epsilon);
      const std::vector<EdgeArc> stored = edge_arcs(piece.wide, arcs, epsilon);
      for (std::uint32_t e = 0; e < arcs.size(); ++e) {
        const Wide half =
            std::atan2(static_cast<Wide>(stored[e].sine), static_cast<Wide>(stored[e].cosine));
        if (arcs[e].full) continue;
        for (int k = 0; k < 2; ++k) {
          // The exact end: the face's normal turned outwards until its apex rises by epsilon.
          const Wide3 along = piece.wide.along[e];
          const Wide3& face = piece.wide.normals[piece.topology.edges[e].face[k]];
          const Wide3 n = unit(face - dot(face, along) * along);
          const Wide sine = std::min<Wide>(1, static_cast<Wide>(epsilon) / arcs[e].width_m[k]);
          const Wide3 out = (k == 0 ? -1.0L : 1.0L) * cross(along, n);
          const Wide3 end = std::sqrt((1 - sine) * (1 + sine)) * n + sine * out;
          const Wide angle =
              std::atan2(dot(end, widen(stored[e].side)), dot(end, widen(stored[e].mid)));
          CHECK((k == 0 ? -angle : angle) <= half);
          CHECK(half - std::abs(angle) <= 1e-7L + std::sqrt(2 * static_cast<Wide>(kRealEpsilon)));
        }
      }
    }
  }

  TEST_CASE("12-prism: over a rim edge the opposite rim rises by about 15 epsilon") {
    const PieceUnderTest piece(prism(12, 0.05, 0.2));
    const double epsilon = 1e-5;
    const double ratio = piece.edge_ratio(epsilon);
    CHECK(ratio >= 1.0);
    // The widest face is 0.2 m across its edge: the margin turns it by as much over epsilon.
    CHECK(ratio <= 1.0 + 1e-8 +
                       1.01 * kMargin_rad * 0.2 /
                           epsilon);  // no vertex is farther across an edge than the face's own
    const VertexRise rim(piece.wide, 0);
    const double rise = static_cast<double>(rim.largest(1e-5L)) / epsilon;
    // Opposite vertex d = sum lambda_k e_k of the two rim edges: 2 r = 2 lambda l sin(15 deg).
    const double rim_edge = 2 * 0.05 * std::sin(std::acos(-1.0) / 12);
    const double lambda = 0.1 / (2 * rim_edge * std::sin(std::acos(-1.0) / 12));
    CHECK(2 * lambda == doctest::Approx(14.93).epsilon(1e-3));
    CHECK(rise == doctest::Approx(2 * lambda).epsilon(1e-9 + 100 * kVertexShare));
    CHECK(
        piece.vertex_relax_m(epsilon) ==
        doctest::Approx(epsilon * (1 + 2 * lambda - 15.0 / 16)).epsilon(1e-8 + 100 * kVertexShare));
  }

  TEST_CASE("a bound that epsilon outgrows stays below the width of the piece") {
    const PieceUnderTest piece(random_hull(7, 32, {0.05, 0.05, 0.05}));
    for (const double epsilon : {1e-4, 1e-3, 1e-2, 1e-1, 1.0}) {
      const double relax = piece.vertex_relax_m(epsilon);
      CHECK(relax >= epsilon);
      CHECK(relax <= (epsilon + 0.1) * (1 + 1e-8));
      CHECK(piece.edge_ratio(epsilon) >= 1.0);
    }
  }

  TEST_CASE("a hull of short edges: the rise is that of a direction, not of a shorter vector") {
    // Directions sampled about every vertex come close to the bound from below.
    const PieceUnderTest piece(random_hull(3, 32, {0.05, 0.05, 0.05}));
    Random random(15);
    for (std::uint32_t v = 0; v < piece.topology.vertex_count; ++v) {
      const VertexRise rise(piece.wide, v);
      const Wide t = rise.depth_m() / 4;
      const Wide bound = rise.largest(t);
      Wide sampled = 0;
      for (int k = 0; k < 20000; ++k) {
        const Wide3 n = unit(unit(piece.wide.vertices[v]) + 1.5L * random_unit(random));
        if (piece.neighbor_rise(n, v) <= t) {
          sampled = std::max(sampled, piece.rise(n, piece.wide.vertices[v]));
        }
      }
      CHECK(sampled <= bound);
      CHECK(sampled >= bound / 2.5L);
    }
  }

  TEST_CASE("random directions never pass the bounds" * doctest::timeout(300)) {
    check_sampled(box({0, 0, 0}, {0.1, 0.06, 0.02}), 1e-3, 11);
    check_sampled(prism(12, 0.05, 0.2), 1e-3, 12);
    check_sampled(random_hull(13, 32, {0.05, 0.04, 0.06}), 1e-3, 13);
    check_sampled(random_hull(14, 32, {0.05, 0.04, 0.06}), 8e-3, 14);  // deeper than the vertices
  }
}
