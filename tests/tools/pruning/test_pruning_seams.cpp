// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "tests/tools/polyhedron/families.hpp"
#include "tests/tools/pruning/contact_sampling.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"
#include "tools/graph_compiler/polyhedron/decomposition.hpp"

namespace haptic::tools::test {
namespace {

constexpr AffineMap kHundredth{{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}, 100};

Solid block(FlatBody& body, const Point2i& low, const Point2i& high, long bottom, long top) {
  return prism(body, {{{low[0], low[1]}, {high[0], low[1]}, {high[0], high[1]}, {low[0], high[1]}}},
               bottom, top, kHundredth);
}

/// Shapes of a static body at the origin, with what hides them.
struct SeamScene {
  explicit SeamScene(PreparedBody prepared) : body(std::move(prepared)) {
    shapes = piece_shapes(body.placed, nullptr, body.exposure.data(), std::nullopt);
  }
  PreparedBody body;
  std::vector<PieceShape> shapes;
};

SeamScene seams(const FlatBody& body, std::vector<Solid> pieces) {
  for (Solid& piece : pieces) normalise(piece);
  return SeamScene(prepared_pieces(body, pieces, "blocks"));
}

/// True when all vertices of feature `vertices` have x = at.
bool at_x(const PieceShape& shape, const std::vector<std::uint32_t>& vertices, double at) {
  return std::all_of(vertices.begin(), vertices.end(),
                     [&](std::uint32_t v) { return std::abs(shape.vertices[v][0] - at) < 1e-12; });
}

std::vector<std::uint32_t> vertices_of_face(const PieceShape& shape, std::size_t f) {
  const auto loop = shape.topology.view().face_vertices(static_cast<std::uint32_t>(f));
  return {loop.begin(), loop.end()};
}

double area(const FragmentPolygon& polygon, const Direction& n) {
  Point3 sum{0, 0, 0};
  for (std::size_t k = 2; k < polygon.size(); ++k) {
    sum = vec::add(
        sum, vec::cross(vec::sub(polygon[k - 1], polygon[0]), vec::sub(polygon[k], polygon[0])));
  }
  return vec::dot(sum, n) / 2;
}

/// Height of p over a piece's most distant face plane: at most 0 inside.
double outside_by(const PieceShape& piece, const Point3& p) {
  double height = -1e9;
  for (std::size_t f = 0; f < piece.normals.size(); ++f) {
    const Point3& on = piece.vertices[vertices_of_face(piece, f)[0]];
    height = std::max(height, vec::dot(piece.normals[f], vec::sub(p, on)));
  }
  return height;
}

/// The definition: n lies in the normal cone at p of every piece that contains p.
bool may_touch(const std::vector<PieceShape>& pieces, const Point3& p, const Direction& n) {
  for (const PieceShape& piece : pieces) {
    if (outside_by(piece, p) > 1e-9) continue;
    for (const Point3& v : piece.vertices) {
      if (vec::dot(n, vec::sub(v, p)) > 1e-9) return false;
    }
  }
  return true;
}

/// Smallest height of p over any face plane of any piece, in absolute value except for planes that
/// hold the whole of `own`: points near a plane are left out of the comparison.
bool clear_of_planes(const std::vector<PieceShape>& pieces, const Point3& p,
                     const std::vector<Point3>& own) {
  for (const PieceShape& piece : pieces) {
    for (std::size_t f = 0; f < piece.normals.size(); ++f) {
      const Point3& on = piece.vertices[vertices_of_face(piece, f)[0]];
      const auto height = [&](const Point3& x) {
        return std::abs(vec::dot(piece.normals[f], vec::sub(x, on)));
      };
      const bool holds =
          std::all_of(own.begin(), own.end(), [&](const Point3& x) { return height(x) < 1e-9; });
      if (!holds && height(p) < 1e-5) return false;
    }
  }
  return true;
}

bool inside_polygon(const FragmentPolygon& polygon, const Direction& n, const Point3& p) {
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Point3& a = polygon[k];
    const Point3& b = polygon[(k + 1) % polygon.size()];
    if (vec::dot(vec::cross(vec::sub(b, a), vec::sub(p, a)), n) < 0) return false;
  }
  return true;
}

Point3 random_mix(const std::vector<Point3>& points, TestRandom& random) {
  Point3 sum{0, 0, 0};
  double total = 0.0;
  for (const Point3& x : points) {
    const double weight = random.uniform() + 1e-3;
    sum = vec::add(sum, vec::scaled(x, weight));
    total += weight;
  }
  return vec::scaled(sum, 1.0 / total);
}

struct Agreement {
  std::size_t faces = 0, edges = 0, vertices = 0, wrong = 0;
};

void compare_faces(const SeamScene& scene, std::size_t i, TestRandom& random, Agreement& result) {
  const PieceShape& shape = scene.shapes[i];
  const PieceExposure& exposure = scene.body.exposure[i];
  for (std::size_t f = 0; f < shape.normals.size(); ++f) {
    std::vector<Point3> corners;
    for (const std::uint32_t v : vertices_of_face(shape, f)) corners.push_back(shape.vertices[v]);
    for (int k = 0; k < 40; ++k) {
      const Point3 p = random_mix(corners, random);
      if (!clear_of_planes(scene.shapes, p, corners)) continue;
      bool open = !exposure.face_hidden[f] && exposure.face_fragments[f].empty();
      for (const FragmentPolygon& polygon : exposure.face_fragments[f]) {
        open = open || inside_polygon(polygon, shape.normals[f], p);
      }
      ++result.faces;
      if (open != may_touch(scene.shapes, p, shape.normals[f])) ++result.wrong;
    }
  }
}

void compare_edges(const SeamScene& scene, std::size_t i, TestRandom& random, Agreement& result) {
  const PieceShape& shape = scene.shapes[i];
  for (std::size_t e = 0; e < shape.topology.edges.size(); ++e) {
    const EdgeRecord& edge = shape.topology.edges[e];
    const Point3 &a = shape.vertices[edge.vertex[0]], &b = shape.vertices[edge.vertex[1]];
    for (int k = 0; k < 40; ++k) {
      const double t = random.uniform();
      const Point3 p = vec::add(a, vec::scaled(vec::sub(b, a), t));
      if (!clear_of_planes(scene.shapes, p, {a, b})) continue;
      const Direction n =
          random_mix({shape.normals[edge.face[0]], shape.normals[edge.face[1]]}, random);
      bool open = false;
      for (const ExposedArc& arc : scene.body.exposure[i].edge_arcs[e]) {
        const SphericalArc s = spherical_arc(arc.from, arc.to);
        open = open || (arc.begin <= t && t <= arc.end && angle_to(vec::unit(n), s) < 1e-9);
      }
      ++result.edges;
      if (open != may_touch(scene.shapes, p, vec::unit(n))) ++result.wrong;
    }
  }
}

void compare_vertices(const SeamScene& scene, std::size_t i, TestRandom& random,
                      Agreement& result) {
  const PieceShape& shape = scene.shapes[i];
  for (std::size_t v = 0; v < shape.vertices.size(); ++v) {
    for (int k = 0; k < 40; ++k) {
      const Direction n = vec::unit(random_mix(shape.vertex_cones[v].corners, random));
      bool open = false;
      for (const SphericalPolygon& cone : shape.open_vertices[v]) {
        open = open || angle_to(n, cone) == 0.0;
      }
      ++result.vertices;
      if (open != may_touch(scene.shapes, shape.vertices[v], n)) ++result.wrong;
    }
  }
}

Agreement compare(const SeamScene& scene, std::uint64_t seed) {
  TestRandom random(seed);
  Agreement result;
  for (std::size_t i = 0; i < scene.shapes.size(); ++i) {
    compare_faces(scene, i, random, result);
    compare_edges(scene, i, random, result);
    compare_vertices(scene, i, random, result);
  }
  return result;
}

}  // namespace

TEST_SUITE("tools.pruning_seams") {
  TEST_CASE("a plate cut in two: the seam is hidden, all else is open as a whole") {
    FlatBody body = empty_body();
    const SeamScene scene =
        seams(body, {block(body, {0, 0}, {4, 6}, 0, 2), block(body, {4, 0}, {10, 6}, 0, 2)});
    for (std::size_t i = 0; i < 2; ++i) {
      const PieceShape& shape = scene.shapes[i];
      const PieceExposure& exposure = scene.body.exposure[i];
      for (std::size_t f = 0; f < 6; ++f) {
        CHECK(exposure.face_hidden[f] == at_x(shape, vertices_of_face(shape, f), 0.04));
        CHECK(exposure.face_fragments[f].empty());
      }
      for (std::size_t e = 0; e < 12; ++e) {
        const EdgeRecord& edge = shape.topology.edges[e];
        CHECK(exposure.edge_hidden[e] == at_x(shape, {edge.vertex[0], edge.vertex[1]}, 0.04));
        if (exposure.edge_hidden[e]) continue;
        REQUIRE(exposure.edge_arcs[e].size() == 1);
        CHECK(exposure.edge_arcs[e][0].begin == 0.0);
        CHECK(exposure.edge_arcs[e][0].end == 1.0);
        CHECK(exposure.edge_arcs[e][0].from == shape.normals[edge.face[0]]);
        CHECK(exposure.edge_arcs[e][0].to == shape.normals[edge.face[1]]);
      }
      for (std::uint32_t v = 0; v < 8; ++v) {
        CHECK(exposure.vertex_hidden[v] == at_x(shape, {v}, 0.04));
        CHECK(exposure.vertex_cone[v].empty());
      }
    }
  }

  TEST_CASE("a block on a plate: the covered part of the face is cut out, its area with it") {
    FlatBody body = empty_body();
    const SeamScene scene =
        seams(body, {block(body, {0, 0}, {10, 8}, 0, 2), block(body, {3, 2}, {5, 5}, 2, 4)});
    std::size_t hidden = 0, partly = 0;
    for (std::size_t i = 0; i < 2; ++i) {
      for (std::size_t f = 0; f < 6; ++f) {
        const PieceExposure& exposure = scene.body.exposure[i];
        hidden += exposure.face_hidden[f] ? 1u : 0u;
        if (exposure.face_fragments[f].empty()) continue;
        ++partly;
        double sum = 0.0;
        for (const FragmentPolygon& polygon : exposure.face_fragments[f]) {
          const double part = area(polygon, scene.shapes[i].normals[f]);
          CHECK(part > 0.0);
          sum += part;
        }
        CHECK(sum == doctest::Approx((80 - 6) * 1e-4).epsilon(1e-12));
      }
    }
    CHECK(hidden == 1);  // the bottom of the block
    CHECK(partly == 1);  // the top of the plate
    CHECK(compare(scene, 1).wrong == 0);
  }

  TEST_CASE("an open edge ends in the corner with another piece, and goes on over a flat cut") {
    const auto ends = [](const SeamScene& scene) {
      std::vector<Point3> found;
      for (std::size_t i = 0; i < scene.shapes.size(); ++i) {
        const PieceExposure& exposure = scene.body.exposure[i];
        REQUIRE(exposure.edge_end.size() == scene.shapes[i].vertices.size());
        for (std::size_t v = 0; v < exposure.edge_end.size(); ++v) {
          if (!exposure.edge_end[v]) continue;
          CHECK(exposure.vertex_hidden[v]);
          found.push_back(scene.shapes[i].vertices[v]);
        }
      }
      return found;
    };
    FlatBody l;
    const std::vector<Solid> stem = {block(l, {0, 0}, {20, 10}, 0, 10),
                                     block(l, {0, 10}, {10, 20}, 0, 10)};
    const std::vector<Point3> corner = ends(seams(l, stem));
    REQUIRE(corner.size() == 2);  // below and above, where the inner edge of the stem ends
    for (const Point3& p : corner) {
      CHECK(p[0] == doctest::Approx(0.1));
      CHECK(p[1] == doctest::Approx(0.1));
    }
    FlatBody bar;
    const std::vector<Solid> halves = {block(bar, {0, 0}, {10, 10}, 0, 10),
                                       block(bar, {10, 0}, {20, 10}, 0, 10)};
    CHECK(ends(seams(bar, halves)).empty());
  }

  TEST_CASE("two blocks that overlap: what lies within the other is hidden, common faces are not") {
    FlatBody body = empty_body();
    const SeamScene scene =
        seams(body, {block(body, {0, 0}, {6, 6}, 0, 2), block(body, {4, 0}, {10, 6}, 0, 2)});
    for (std::size_t i = 0; i < 2; ++i) {
      const double within = i == 0 ? 0.06 : 0.04;
      const PieceShape& shape = scene.shapes[i];
      for (std::size_t f = 0; f < 6; ++f) {
        CHECK(scene.body.exposure[i].face_hidden[f] ==
              at_x(shape, vertices_of_face(shape, f), within));
        CHECK(scene.body.exposure[i].face_fragments[f].empty());
      }
    }
    CHECK(compare(scene, 2).wrong == 0);
  }

  TEST_CASE("sampled points and normals: open exactly where the definition says") {
    std::size_t edges = 0, vertices = 0;
    for (std::uint64_t seed = 1; seed <= 40; ++seed) {
      CAPTURE(seed);
      FlatBody body = seed % 2 == 0 ? random_boxes(seed) : random_cells(seed);
      const SeamScene scene(prepared(body, "random"));
      const Agreement result = compare(scene, seed);
      CHECK(result.wrong == 0);
      edges += result.edges;
      vertices += result.vertices;
    }
    FlatBody holes = plate_with_turned_holes(3, 5, general_map(3000));
    const SeamScene scene(prepared(holes, "holes"));
    const Agreement result = compare(scene, 3);
    CHECK(result.wrong == 0);
    MESSAGE((edges + result.edges)
            << " normals on edges, " << (vertices + result.vertices) << " at vertices");
    CHECK(edges > 10000);
    CHECK(vertices > 10000);
  }

  TEST_CASE("the comparison sees a piece that the exposure does not know of") {
    FlatBody body = empty_body();
    std::vector<Solid> pieces{block(body, {0, 0}, {4, 6}, 0, 2),
                              block(body, {4, 0}, {10, 6}, 0, 2)};
    for (Solid& piece : pieces) normalise(piece);
    SeamScene scene(prepared_pieces(body, pieces, "blocks"));
    REQUIRE(compare(scene, 4).wrong == 0);
    scene.body.exposure[0] = prepared_pieces(body, {pieces[0]}, "alone").exposure[0];
    CHECK(compare(scene, 4).wrong > 0);
  }
}

}  // namespace haptic::tools::test
