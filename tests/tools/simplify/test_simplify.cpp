// SPDX-License-Identifier: Apache-2.0
/// Simplification of parts whose answer is known by formula: bevels, rounds, and what must stay.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "tests/tools/polyhedron/flatten_parts.hpp"
#include "tests/tools/polyhedron/part_surface.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/polyhedron/decomposition.hpp"
#include "tools/graph_compiler/simplify/simplification.hpp"

namespace haptic::tools {
namespace {

using parts::Part;
using Outline = std::vector<std::array<double, 2>>;

Simplified simplified(const Surface& surface, double distance_m) {
  return simplify(surface, {distance_m, 1.0}, {});
}

std::size_t certified_pieces(Simplified& result) {
  // A vertex of the file is one corner at most.
  std::map<std::int64_t, int> corners;
  for (const std::int64_t source : result.body.world.source_vertex) ++corners[source];
  for (const auto& [source, count] : corners) CHECK((source < 0 || count == 1));
  const Decomposition pieces = decompose(result.body, "part", {});
  CHECK(pieces.certificate.holds());
  return pieces.pieces.size();
}

/// Relative only: doctest's own scale of 1 would accept any length of a part.
doctest::Approx about(double value, double relative = 1.0e-9) {
  return doctest::Approx(value).epsilon(relative).scale(0.0);
}

/// An L of 60 mm with a round of radius r and n chords in its inner corner.
Outline filleted_l(double r, int n) {
  Outline out{{0, 0}, {0.06, 0}, {0.06, 0.02}};
  for (int k = 0; k <= n; ++k) {
    const double angle = 0.5 * std::numbers::pi * k / n;
    out.push_back({0.02 + r - r * std::sin(angle), 0.02 + r - r * std::cos(angle)});
  }
  out.push_back({0.02, 0.06});
  out.push_back({0, 0.06});
  return out;
}

/// Cuts a corner of three faces off, `c` along each of its edges.
void cut_corner(Part& part, std::uint32_t corner, double c) {
  std::map<std::uint32_t, std::uint32_t> cut, next;  // by far end of an edge; of the new face
  const Point3 from = part.vertices[corner];
  const auto cut_at = [&](std::uint32_t end) {
    const auto [it, fresh] = cut.emplace(end, static_cast<std::uint32_t>(part.vertices.size()));
    if (fresh) {
      const Point3 along = vec::unit(vec::sub(part.vertices[end], from));
      part.vertices.push_back(vec::add(from, vec::scaled(along, c)));
    }
    return it->second;
  };
  for (std::vector<std::uint32_t>& face : part.faces) {
    const auto at = std::find(face.begin(), face.end(), corner);
    if (at == face.end()) continue;
    const auto k = static_cast<std::size_t>(at - face.begin());
    const std::uint32_t in = cut_at(face[(k + face.size() - 1) % face.size()]);
    const std::uint32_t out = cut_at(face[(k + 1) % face.size()]);
    next[out] = in;
    face[k] = in;
    face.insert(face.begin() + static_cast<std::ptrdiff_t>(k) + 1, out);
  }
  const std::uint32_t first = next.begin()->first;
  part.faces.push_back({first, next.at(first), next.at(next.at(first))});
}

TEST_SUITE("tools.simplify") {
  TEST_CASE("simplify: bevelled vertical edges go; the distance is that of the corner") {
    const double c = 0.001;
    const Outline outline{{c, 0},           {0.05 - c, 0}, {0.05, c},     {0.05, 0.03 - c},
                          {0.05 - c, 0.03}, {c, 0.03},     {0, 0.03 - c}, {0, c}};
    Simplified result = simplified(parts::surface_of({parts::prism(outline, 0.0, 0.02)}), 0.0008);
    CHECK(result.account.planes_before == 10);
    CHECK(result.account.planes_after == 6);
    // From the new edge to the bevel: c / sqrt(2).
    CHECK(result.account.hausdorff_m == about(c / std::numbers::sqrt2, 0.002));
    CHECK(result.account.hausdorff_at_least_m <= c / std::numbers::sqrt2 * (1.0 + 1e-9));
    CHECK(result.account.hausdorff_m >= c / std::numbers::sqrt2 * (1.0 - 1e-9));
    CHECK(result.account.volume_after_m3 == about(0.05 * 0.03 * 0.02));
    CHECK(result.account.volume_after_m3 - result.account.volume_before_m3 ==
          about(4 * 0.5 * c * c * 0.02, 1.0e-6));
    CHECK(certified_pieces(result) == 1);
  }

  TEST_CASE("simplify: a bevel above the distance stays, and nothing changes") {
    const double c = 0.001;
    const Outline outline{{c, 0}, {0.05, 0}, {0.05, 0.03}, {0, 0.03}, {0, c}};
    Simplified result = simplified(parts::surface_of({parts::prism(outline, 0.0, 0.02)}), 0.0003);
    CHECK_FALSE(result.account.changed);
    CHECK(result.account.planes_after == 7);
    CHECK(result.account.hausdorff_m <= 1.0e-6);
  }

  TEST_CASE("simplify: the distance is known to 1e-3 of itself, however much was allowed") {
    // Unlike legs: from the new edge to the bevel is the height of the right triangle.
    const double a = 0.0002, b = 0.0003;
    const Outline outline{{a, 0}, {0.05, 0}, {0.05, 0.03}, {0, 0.03}, {0, b}};
    const double height = a * b / std::hypot(a, b);
    Simplified result = simplified(parts::surface_of({parts::prism(outline, 0.0, 0.02)}), 0.005);
    CHECK(result.account.planes_after == 6);
    CHECK(result.account.hausdorff_m >= height * (1.0 - 1.0e-9));
    CHECK(result.account.hausdorff_at_least_m <= height * (1.0 + 1.0e-9));
    CHECK(result.account.hausdorff_m <= height * 1.0011);
    CHECK(result.account.hausdorff_at_least_m >= height * 0.9989);
  }

  TEST_CASE("simplify: a corner cut off comes back, at its height over the cut") {
    const double c = 0.0004;
    Part box = parts::prism({{0, 0}, {0.05, 0}, {0.05, 0.03}, {0, 0.03}}, 0.0, 0.02);
    cut_corner(box, 6, c);
    Simplified result = simplified(parts::surface_of({box}), 0.0004);
    CHECK(result.account.planes_before == 7);
    CHECK(result.account.planes_after == 6);
    CHECK(result.account.hausdorff_m == about(c / std::numbers::sqrt3, 0.002));
    CHECK(result.account.volume_after_m3 - result.account.volume_before_m3 ==
          about(c * c * c / 6.0, 1.0e-4));
  }

  TEST_CASE("simplify: the fillet of an L goes, and it is two pieces") {
    const double r = 0.002;
    const int n = 8;
    Simplified result =
        simplified(parts::surface_of({parts::prism(filleted_l(r, n), 0.0, 0.02)}), 0.0013);
    CHECK(result.account.reflex_before == n + 1);
    CHECK(result.account.reflex_after == 1);
    // From the corner to the middle of the round; the area under n chords of a quarter turn.
    CHECK(result.account.hausdorff_m == about(r * (std::numbers::sqrt2 - 1), 0.002));
    const double fillet = r * r * (1.0 - 0.5 * n * std::sin(0.5 * std::numbers::pi / n));
    CHECK(result.account.volume_before_m3 - result.account.volume_after_m3 ==
          about(fillet * 0.02, 1.0e-6));
    CHECK(certified_pieces(result) == 2);
  }

  TEST_CASE("simplify: the rounded rim of a ring goes to a sharp one, the bore stays") {
    // A ring of n sides, outer radius R, bore B, height H; the upper outer rim rounded with radius
    // r in m steps.
    const int n = 16, m = 6;
    const double outer = 0.02, bore = 0.01, height = 0.008, r = 0.0005;
    std::vector<std::vector<Point3>> rings{parts::ring(n, outer, 0.0)};
    for (int k = 0; k <= m; ++k) {
      const double angle = 0.5 * std::numbers::pi * k / m;
      rings.push_back(
          parts::ring(n, outer - r + r * std::cos(angle), height - r + r * std::sin(angle)));
    }
    rings.push_back(parts::ring(n, bore, height));
    rings.push_back(parts::ring(n, bore, 0.0));
    Part ring;
    for (const std::vector<Point3>& loop : rings) {
      ring.vertices.insert(ring.vertices.end(), loop.begin(), loop.end());
    }
    const auto sides = static_cast<std::uint32_t>(n);
    const auto loops = static_cast<std::uint32_t>(rings.size());
    for (std::uint32_t k = 0; k < loops; ++k) {
      const std::uint32_t low = k * sides, high = (k + 1) % loops * sides;
      for (std::uint32_t i = 0; i < sides; ++i) {
        const std::uint32_t j = (i + 1) % sides;
        ring.faces.push_back({low + i, low + j, high + j, high + i});
      }
    }
    Simplified result = simplify(parts::surface_of({ring}), {0.0004, 0.8}, {});
    CHECK(result.account.planes_before == 2U * n + 2U + static_cast<std::size_t>(n * m));
    CHECK(result.account.planes_after == 2U * n + 2U);
    CHECK(result.account.reflex_after == n);
    CHECK(result.account.hausdorff_m == about(r * (std::numbers::sqrt2 - 1), 0.002));
    // Area of a regular polygon of n sides by its circumradius.
    const double share = 0.5 * n * std::sin(2 * std::numbers::pi / n);
    CHECK(result.account.volume_after_m3 ==
          about(share * (outer * outer - bore * bore) * height, 1.0e-6));
    CHECK(certified_pieces(result) == n);
  }

  TEST_CASE("simplify: a hole is never closed, however large the distance") {
    // A square ring with a hole of 4 mm, distance 5 mm: walls may move, the hole may not go.
    const std::vector<Point3> outer_low{{0, 0, 0}, {0.04, 0, 0}, {0.04, 0.04, 0}, {0, 0.04, 0}};
    const auto raised = [](std::vector<Point3> ring, double z) {
      for (Point3& p : ring) p[2] = z;
      return ring;
    };
    const std::vector<Point3> inner_low{
        {0.018, 0.018, 0}, {0.022, 0.018, 0}, {0.022, 0.022, 0}, {0.018, 0.022, 0}};
    Part ring;
    for (const auto& loop :
         {outer_low, raised(outer_low, 0.02), inner_low, raised(inner_low, 0.02)}) {
      for (const Point3& p : loop) ring.vertices.push_back(p);
    }
    for (std::uint32_t k = 0; k < 4; ++k) {
      const std::uint32_t n = (k + 1) % 4;
      ring.faces.push_back({k, n, 4 + n, 4 + k});
      ring.faces.push_back({8 + n, 8 + k, 12 + k, 12 + n});
      ring.faces.push_back({4 + k, 4 + n, 12 + n, 12 + k});
      ring.faces.push_back({n, k, 8 + k, 8 + n});
    }
    Simplified result = simplified(parts::surface_of({ring}), 0.005);
    // Two of its walls may become one, no more: a hole has at least three.
    CHECK(result.account.reflex_after >= 3);
    CHECK(result.account.hausdorff_m <= 0.005);
    CHECK(certified_pieces(result) >= 3);
  }

  TEST_CASE("simplify: a distance that leaves too many reflex edges is refused with the count") {
    FlattenLimits limits;
    limits.max_reflex_edges = 3;
    try {
      simplify(parts::surface_of({parts::prism(filleted_l(0.002, 8), 0.0, 0.02)}), {1.0e-6, 1.0},
               limits);
      FAIL("accepted");
    } catch (const InputError& error) {
      const std::string text = error.what();
      CHECK(text.find("9 reflex edges are left of 9") != std::string::npos);
      CHECK(text.find("give a larger distance") != std::string::npos);
    }
  }

  TEST_CASE("hausdorff_distance: shifted squares, a point inside a face, and one direction alone") {
    const std::vector<FaceTriangle> square{{Point3{0, 0, 0}, Point3{1, 0, 0}, Point3{1, 1, 0}},
                                           {Point3{0, 0, 0}, Point3{1, 1, 0}, Point3{0, 1, 0}}};
    std::vector<FaceTriangle> lifted = square;
    for (FaceTriangle& t : lifted) {
      for (Point3& p : t) p[2] = 0.25;
    }
    const SurfaceDistance even = hausdorff_distance(square, lifted, {1e-3, 1e-9});
    CHECK(even.complete);
    CHECK(even.at_most_m >= 0.25);
    CHECK(even.at_most_m <= 0.25 * 1.001);
    // A tent over the square: farthest at its tip, which no corner of the square shows.
    const Point3 tip{0.5, 0.5, 0.3};
    const std::vector<FaceTriangle> tent{{Point3{0, 0, 0}, Point3{1, 0, 0}, tip},
                                         {Point3{1, 0, 0}, Point3{1, 1, 0}, tip},
                                         {Point3{1, 1, 0}, Point3{0, 1, 0}, tip},
                                         {Point3{0, 1, 0}, Point3{0, 0, 0}, tip}};
    const SurfaceDistance up = hausdorff_distance(square, tent, {1e-3, 1e-9});
    CHECK(up.at_least_m == about(0.3));
    CHECK(up.at_most_m <= 0.3 * 1.0011);
    // The bottom alone against a box without lid: the walls are far from it.
    std::vector<FaceTriangle> walled = square;
    walled.push_back({Point3{0, 0, 0}, Point3{1, 0, 0}, Point3{0, 0, 2}});
    const SurfaceDistance walls = hausdorff_distance(square, walled, {1e-3, 1e-9});
    CHECK(walls.at_least_m == about(2.0));
    CHECK(hausdorff_distance(square, square, {1e-3, 1e-9}).at_most_m <= 1.0e-9);
  }
}

}  // namespace
}  // namespace haptic::tools
