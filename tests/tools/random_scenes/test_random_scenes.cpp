// SPDX-License-Identifier: Apache-2.0
/// Random parts from mesh to pieces: the certificate of each, and the verdict "free of every piece"
/// against an exact test on the uncut mesh. The two may differ by the movement of corners that the
/// compiler states, no farther.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "tests/tools/random_scenes/prism_scene.hpp"
#include "tools/graph_compiler/mesh/cleaning.hpp"
#include "tools/graph_compiler/polyhedron/decomposition.hpp"

namespace haptic::tools {
namespace {

using test::OracleMesh;
using test::OraclePoint;

double dot3(const OraclePoint& a, const OraclePoint& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
OraclePoint minus(const OraclePoint& a, const OraclePoint& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
OraclePoint cross3(const OraclePoint& a, const OraclePoint& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// A convex polyhedron for the separating axis test.
struct Hull {
  std::vector<OraclePoint> vertices, normals, edges;
};

/// Largest gap along the directions that can separate two convex polyhedra [m]; <= 0: they overlap.
double gap(const Hull& a, const Hull& b) {
  double best = -1.0;
  const auto along = [&](const OraclePoint& n) {
    const double length = std::sqrt(dot3(n, n));
    if (length < 1.0e-9) return;  // edges are of unit length: parallel ones separate nothing new
    double high_a = -1e9, low_a = 1e9, high_b = -1e9, low_b = 1e9;
    for (const OraclePoint& p : a.vertices) {
      high_a = std::max(high_a, dot3(n, p));
      low_a = std::min(low_a, dot3(n, p));
    }
    for (const OraclePoint& p : b.vertices) {
      high_b = std::max(high_b, dot3(n, p));
      low_b = std::min(low_b, dot3(n, p));
    }
    best = std::max(best, std::max(low_b - high_a, low_a - high_b) / length);
  };
  for (const OraclePoint& n : a.normals) along(n);
  for (const OraclePoint& n : b.normals) along(n);
  for (const OraclePoint& e : a.edges) {
    if (best > 0.0) break;
    for (const OraclePoint& f : b.edges) along(cross3(e, f));
  }
  return best;
}

void add_direction(std::vector<OraclePoint>& to, OraclePoint e) {
  const double length = std::sqrt(dot3(e, e));
  for (double& x : e) x /= length;
  const bool known = std::any_of(to.begin(), to.end(), [&](const OraclePoint& k) {
    return std::abs(dot3(k, e)) > 1.0 - 1.0e-14;
  });
  if (!known) to.push_back(e);
}

Hull hull_of(const Body& body, const ConvexPiece& piece) {
  Hull hull;
  hull.vertices = piece.vertices;
  for (const PieceFace& face : piece.faces) {
    hull.normals.push_back(body.planes[face.plane].normal);
    for (std::size_t k = 0; k < face.loop.size(); ++k) {
      add_direction(hull.edges, minus(piece.vertices[face.loop[(k + 1) % face.loop.size()]],
                                      piece.vertices[face.loop[k]]));
    }
  }
  return hull;
}

/// A tetrahedron or a brick, about as wide as a hole.
OracleMesh moving_part(test::SceneRandom& random) {
  OracleMesh part;
  const double a = 0.004 + 0.012 * random.unit(), b = 0.004 + 0.012 * random.unit(),
               c = 0.004 + 0.03 * random.unit();
  if (random.unit() < 0.5) {
    part.points = {{-a, -b, -c}, {a, -b, 0.5 * c}, {0.0, b, -c}, {0.0, 0.0, c}};
    part.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
    return part;
  }
  for (std::uint32_t k = 0; k < 8; ++k) {
    part.points.push_back({(k & 1U) != 0 ? a : -a, (k & 2U) != 0 ? b : -b, (k & 4U) != 0 ? c : -c});
  }
  part.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return part;
}

Hull hull_of(const OracleMesh& mesh) {
  Hull hull;
  hull.vertices = mesh.points;
  for (const test::OracleTriangle& t : mesh.triangles) {
    const OraclePoint& p = mesh.points[t[0]];
    const OraclePoint n = cross3(minus(mesh.points[t[1]], p), minus(mesh.points[t[2]], p));
    add_direction(hull.normals, n);
    for (std::size_t k = 0; k < 3; ++k) {
      add_direction(hull.edges, minus(mesh.points[t[(k + 1) % 3]], mesh.points[t[k]]));
    }
  }
  return hull;
}

struct Tally {
  std::uint64_t poses = 0, meet = 0, free_inside = 0, wrong = 0, ties = 0;
  std::uint64_t grazing = 0, grazing_ties = 0;
  std::size_t genus = 0, pieces = 0, moved = 0;
  double largest_move_m = 0.0;  // stated for a part
  double largest_tie_m = 0.0;   // gap of a pose of which the verdicts differ
  test::OracleCounts counts;
};

// Gaps below this are lost in the roundings of the pieces' own coordinates.
constexpr double kTie_m = 1.0e-13;
// Corners move by less when they are placed exactly on the planes of a turned part.
constexpr double kLargestMove_m = 1.0e-8;

/// One moving part against one scene: the verdict of the pieces and that of the uncut mesh.
struct Question {
  const OracleMesh& uncut;
  const std::vector<Hull>& pieces;
  const OracleMesh& part;
  double tie_m;  // verdicts may differ where the gap is no more: movement stated, and rounding
  Tally& tally;

  [[nodiscard]] OracleMesh placed(const std::array<double, 4>& q, const OraclePoint& at) const {
    OracleMesh mesh = part;
    for (OraclePoint& p : mesh.points) p = test::moved(p, q, at);
    return mesh;
  }
  [[nodiscard]] bool meets(const std::array<double, 4>& q, const OraclePoint& at) {
    return test::meshes_meet(placed(q, at), uncut, tally.counts);
  }
  /// Compares the two and counts. Returns the verdict of the uncut mesh.
  bool ask(const std::array<double, 4>& q, const OraclePoint& at) {
    const OracleMesh mesh = placed(q, at);
    const Hull hull = hull_of(mesh);
    double least = 1.0;
    for (const Hull& piece : pieces) least = std::min(least, gap(hull, piece));
    const bool meet = test::meshes_meet(mesh, uncut, tally.counts);
    ++tally.poses;
    tally.meet += meet ? 1 : 0;
    if (meet == (least <= 0.0)) return meet;
    ++(std::abs(least) <= tie_m ? tally.ties : tally.wrong);
    tally.largest_tie_m = std::max(tally.largest_tie_m, std::abs(least));
    CAPTURE(least);
    CHECK(std::abs(least) <= tie_m);
    return meet;
  }
};

/// Poses about a contact between a free place and one that meets, found by bisection with the exact
/// test: the last two neighbours in double, then 1e-12 to 1e-6 m to either side of them.
void graze(Question& question, const std::array<double, 4>& q, OraclePoint free, OraclePoint met) {
  const auto between = [&](double t) {
    OraclePoint p{};
    for (std::size_t i = 0; i < 3; ++i) p[i] = free[i] + t * (met[i] - free[i]);
    return p;
  };
  double low = 0.0, high = 1.0;
  for (int k = 0; k < 60; ++k) {
    const double middle = 0.5 * (low + high);
    if (middle == low || middle == high) break;
    (question.meets(q, between(middle)) ? high : low) = middle;
  }
  const OraclePoint whole = minus(met, free);
  const double length = std::sqrt(dot3(whole, whole));
  for (const double step_m : {0.0, 1e-12, 1e-10, 1e-8, 1e-6}) {
    for (const double t : {low - step_m / length, high + step_m / length}) {
      const std::uint64_t ties = question.tally.ties;
      question.ask(q, between(t));
      ++question.tally.grazing;
      question.tally.grazing_ties += question.tally.ties - ties;
    }
  }
}

void run_scene(std::uint64_t seed, int poses, Tally& tally) {
  CAPTURE(seed);
  const test::PrismScene scene = test::prism_scene(seed);
  const Surface surface = clean_surface(scene.mesh, {});
  FlatBody flat = flatten(surface, {});
  const Decomposition pieces = decompose(flat, scene.mesh.file, {});
  REQUIRE(pieces.certificate.holds());
  CHECK_FALSE(pieces.certificate.cover);
  CHECK(pieces.pieces.size() > 1);
  const Body body = to_body(flat, pieces, "scene");
  CHECK(flat.largest_move_m <= kLargestMove_m);
  tally.genus += scene.genus > 0 ? 1 : 0;
  tally.moved += flat.largest_move_m > kTie_m ? 1 : 0;
  tally.largest_move_m = std::max(tally.largest_move_m, flat.largest_move_m);
  tally.pieces += body.pieces.size();
  std::vector<Hull> hulls;
  for (const ConvexPiece& piece : body.pieces) hulls.push_back(hull_of(body, piece));
  OraclePoint low = scene.oracle.points[0], high = low;
  for (const OraclePoint& p : scene.oracle.points) {
    for (std::size_t i = 0; i < 3; ++i) {
      low[i] = std::min(low[i], p[i]);
      high[i] = std::max(high[i], p[i]);
    }
  }
  test::SceneRandom random(seed + 777);
  const OracleMesh part = moving_part(random);
  Question question{scene.oracle, hulls, part, kTie_m + flat.largest_move_m, tally};
  for (int k = 0; k < poses; ++k) {
    OraclePoint at{};
    bool within = true;
    for (std::size_t i = 0; i < 3; ++i) {
      at[i] = low[i] + (high[i] - low[i]) * (1.3 * random.unit() - 0.15);
      within = within && at[i] > low[i] && at[i] < high[i];
    }
    const std::array<double, 4> q{random.unit() - 0.5, random.unit() - 0.5, random.unit() - 0.5,
                                  random.unit() - 0.499};
    CAPTURE(k);
    const bool meet = question.ask(q, at);
    tally.free_inside += !meet && within ? 1 : 0;
    if (k % 10 != 0) continue;
    // Out along the diagonal of the box, where it is free, and back to the first contact.
    OraclePoint out = at;
    for (std::size_t i = 0; i < 3; ++i) out[i] += (at[i] + at[i] > low[i] + high[i] ? 1 : -1) * 0.2;
    if (meet && !question.meets(q, out)) graze(question, q, out, at);
  }
}

void run_scenes(std::uint64_t first, int scenes, int poses) {
  Tally tally;
  for (int s = 0; s < scenes; ++s) run_scene(first + static_cast<std::uint64_t>(s), poses, tally);
  MESSAGE("seeds ", first, " to ", first + static_cast<std::uint64_t>(scenes) - 1, ": ",
          tally.genus, " with holes, ", tally.pieces, " pieces, ", tally.poses, " poses, ",
          tally.meet, " meet, ", tally.free_inside, " free within the box, ", tally.grazing,
          " grazing, ", tally.ties, " ties (", tally.grazing_ties, " grazing), gap at most ",
          tally.largest_tie_m, " m; corners moved by more than ", kTie_m, " m in ", tally.moved,
          " scenes, at most ", tally.largest_move_m, " m; ", tally.wrong, " wrong; ",
          tally.counts.signs, " signs, ", tally.counts.exact, " exact");
  CHECK(tally.wrong == 0);
  // The question must not be trivial: many of each kind, and free poses in holes and corners.
  CHECK(tally.meet * 10 > tally.poses);
  CHECK((tally.poses - tally.meet) * 10 > tally.poses);
  CHECK(tally.free_inside * 50 > tally.poses - tally.grazing);
  CHECK(tally.grazing * 20 > tally.poses);
  CHECK(tally.ties * 20 < tally.grazing);
  CHECK(tally.genus * 3 >= static_cast<std::size_t>(scenes));
}

TEST_SUITE("tools.random_scenes") {
  TEST_CASE("random scenes: certified, and free of every piece iff free of the uncut mesh") {
    run_scenes(1, 6, 300);
  }

  TEST_CASE("random scenes: [long] a hundred scenes at ten thousand poses each") {
    run_scenes(1000, 100, 10000);
  }

  TEST_CASE("random scenes: the exact oracle on cases decided by hand") {
    test::OracleCounts counts;
    const OracleMesh tetrahedron{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                                 {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}};
    const auto shifted = [&](double x, double y, double z, double scale) {
      OracleMesh mesh = tetrahedron;
      for (OraclePoint& p : mesh.points) p = {scale * p[0] + x, scale * p[1] + y, scale * p[2] + z};
      return mesh;
    };
    CHECK(test::meshes_meet(tetrahedron, shifted(0.1, 0.1, 0.1, 0.1), counts));  // inside
    CHECK(test::meshes_meet(shifted(0.1, 0.1, 0.1, 0.1), tetrahedron, counts));  // around
    CHECK(test::meshes_meet(tetrahedron, shifted(1.0, 0.0, 0.0, 1.0), counts));  // corner on corner
    CHECK_FALSE(test::meshes_meet(tetrahedron, shifted(1.0 + 0x1p-52, 0.0, 0.0, 1.0), counts));
    CHECK(test::meshes_meet(tetrahedron, shifted(0.25, 0.25, -1.0, 1.0), counts));  // tip on face
    CHECK_FALSE(test::meshes_meet(tetrahedron, shifted(0.6, 0.6, 0.6, 1.0), counts));
    CHECK(counts.exact > 0);
    CHECK(test::is_inside({0.2, 0.2, 0.2}, tetrahedron, counts));
    CHECK_FALSE(test::is_inside({0.4, 0.4, 0.4}, tetrahedron, counts));
  }
}

}  // namespace
}  // namespace haptic::tools
