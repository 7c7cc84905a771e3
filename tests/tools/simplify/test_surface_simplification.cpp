// SPDX-License-Identifier: Apache-2.0
/// Simplification of surfaces, judged by points on both of them and distances of another method.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <utility>

#include "tests/tools/mesh/mesh_builder.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"
#include "tools/graph_compiler/shapes/shape.hpp"
#include "tools/graph_compiler/simplify/reach_proof.hpp"
#include "tools/graph_compiler/simplify/surface_distance.hpp"
#include "tools/graph_compiler/simplify/surface_simplification.hpp"

using namespace haptic::tools;
using haptic::tools::test::contains;
using haptic::tools::test::MeshBuilder;

namespace {

using Triangles = std::vector<FaceTriangle>;
using Long3 = std::array<long double, 3>;

Triangles triangles_of_part(const SurfacePart& part) {
  Triangles out;
  for (const SurfacePart::Facet& facet : part.facets) {
    for (std::size_t k = 1; k + 1 < facet.loop.size(); ++k) {
      out.push_back({part.vertices_m[facet.loop[0]], part.vertices_m[facet.loop[k]],
                     part.vertices_m[facet.loop[k + 1]]});
    }
  }
  return out;
}

SurfacePart part_of(const RawMesh& raw) { return make_surface_part(raw, {}); }

SimplifiedPart simplified(const RawMesh& raw, double tolerance_m) {
  return simplified_surface(raw, {}, tolerance_m, {});
}

// The judge: no tree, no branch and bound, no code of the simplification, more digits.

Long3 long_minus(const Long3& a, const Long3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
long double long_dot(const Long3& a, const Long3& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
Long3 to_long(const Point3& p) { return {p[0], p[1], p[2]}; }

long double square_to_segment(const Long3& p, const Long3& a, const Long3& b) {
  const Long3 ab = long_minus(b, a), ap = long_minus(p, a);
  const long double length = long_dot(ab, ab);
  const long double s = length > 0 ? std::clamp(long_dot(ap, ab) / length, 0.0L, 1.0L) : 0.0L;
  const Long3 off{ap[0] - s * ab[0], ap[1] - s * ab[1], ap[2] - s * ab[2]};
  return long_dot(off, off);
}

/// By the three sides, and by the foot in the plane where it lies inside.
long double square_to_triangle(const Long3& p, const FaceTriangle& t) {
  const std::array<Long3, 3> c{to_long(t[0]), to_long(t[1]), to_long(t[2])};
  long double least = square_to_segment(p, c[0], c[1]);
  least = std::min(least, square_to_segment(p, c[1], c[2]));
  least = std::min(least, square_to_segment(p, c[2], c[0]));
  const Long3 u = long_minus(c[1], c[0]), v = long_minus(c[2], c[0]), w = long_minus(p, c[0]);
  const long double uu = long_dot(u, u), uv = long_dot(u, v), vv = long_dot(v, v),
                    wu = long_dot(w, u), wv = long_dot(w, v);
  const long double det = uu * vv - uv * uv;
  if (!(det > 0)) return least;
  const long double s = (vv * wu - uv * wv) / det, r = (uu * wv - uv * wu) / det;
  if (s < 0 || r < 0 || s + r > 1) return least;
  const Long3 off{w[0] - s * u[0] - r * v[0], w[1] - s * u[1] - r * v[1],
                  w[2] - s * u[2] - r * v[2]};
  return std::min(least, long_dot(off, off));
}

/// Largest distance of sampled points of `from` from `to`: a grid of `steps` on each side.
double sampled_distance(const Triangles& from, const Triangles& to, int steps) {
  long double largest = 0;
  for (const FaceTriangle& t : from) {
    for (int i = 0; i <= steps; ++i) {
      for (int k = 0; i + k <= steps; ++k) {
        Long3 p{};
        for (std::size_t x = 0; x < 3; ++x) {
          p[x] = (static_cast<long double>(i) * t[0][x] + static_cast<long double>(k) * t[1][x] +
                  static_cast<long double>(steps - i - k) * t[2][x]) /
                 steps;
        }
        long double least = HUGE_VALL;
        for (const FaceTriangle& other : to) {
          least = std::min(least, square_to_triangle(p, other));
          if (least <= largest) break;
        }
        largest = std::max(largest, least);
      }
    }
  }
  return static_cast<double>(std::sqrt(largest));
}

/// Nothing where the certificate holds at all sampled points, else what is wrong.
std::string objection(const Triangles& given, const Triangles& result,
                      const CollapseAccount& account, int steps) {
  constexpr double kRounding = 1.0 + 1.0e-9;
  const double there = sampled_distance(given, result, steps);
  const double back = sampled_distance(result, given, steps);
  if (there > account.given_to_result_m * kRounding + 1.0e-15) return "given to result";
  if (back > account.result_to_given_m * kRounding + 1.0e-15) return "result to given";
  return {};
}

struct Topology {
  long euler = 0;
  bool closed = true;
};

Topology topology_of(const SurfacePart& part) {
  std::map<std::array<std::uint32_t, 2>, int> edges;
  std::set<std::uint32_t> vertices;
  for (const SurfacePart::Facet& facet : part.facets) {
    for (std::size_t k = 0; k < facet.loop.size(); ++k) {
      const std::uint32_t a = facet.loop[k], b = facet.loop[(k + 1) % facet.loop.size()];
      ++edges[{std::min(a, b), std::max(a, b)}];
      vertices.insert(a);
    }
  }
  Topology out;
  out.euler = static_cast<long>(vertices.size()) - static_cast<long>(edges.size()) +
              static_cast<long>(part.facets.size());
  for (const auto& [edge, count] : edges) out.closed = out.closed && count == 2;
  return out;
}

/// A box whose sides are grids of n x n quads.
RawMesh grid_box(int n) {
  MeshBuilder m;
  std::map<std::array<int, 3>, std::uint32_t> number;
  const auto at = [&](std::array<int, 3> p) {
    const auto [it, fresh] = number.emplace(p, 0);
    if (fresh) {
      it->second = m.vertex({0.03 * p[0] / n, 0.02 * p[1] / n, 0.01 * p[2] / n});
    }
    return it->second;
  };
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const int side : {0, n}) {
      for (int i = 0; i < n; ++i) {
        for (int k = 0; k < n; ++k) {
          const auto corner = [&](int a, int b) {
            std::array<int, 3> p{};
            p[axis] = side;
            p[(axis + 1) % 3] = a;
            p[(axis + 2) % 3] = b;
            return at(p);
          };
          std::vector<std::uint32_t> loop{corner(i, k), corner(i + 1, k), corner(i + 1, k + 1),
                                          corner(i, k + 1)};
          if (side == 0) std::reverse(loop.begin(), loop.end());
          m.face(std::move(loop));
        }
      }
    }
  }
  return m.raw();
}

/// A sheet of n x n quads, bent like a saddle.
RawMesh saddle(int n, double height_m) {
  MeshBuilder m;
  for (int i = 0; i <= n; ++i) {
    for (int k = 0; k <= n; ++k) {
      const double x = 2.0 * i / n - 1.0, y = 2.0 * k / n - 1.0;
      m.vertex({0.02 * x, 0.02 * y, height_m * (x * x - y * y)});
    }
  }
  const auto at = [&](int i, int k) { return static_cast<std::uint32_t>(i * (n + 1) + k); };
  for (int i = 0; i < n; ++i) {
    for (int k = 0; k < n; ++k) {
      m.face({at(i, k), at(i + 1, k), at(i + 1, k + 1)});
      m.face({at(i, k), at(i + 1, k + 1), at(i, k + 1)});
    }
  }
  return m.raw();
}

std::string refusal_of(const RawMesh& raw, double tolerance_m) {
  try {
    simplified(raw, tolerance_m);
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

}  // namespace

TEST_SUITE("tools.surface_simplification") {
  TEST_CASE("a triangle is within reach of two that cover it together, and of none that do not") {
    const FaceTriangle whole{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}};
    Triangles halves{{{{0, 0, 0}, {1, 0, 0}, {0.4, 0.6, 0}}},
                     {{{0, 0, 0}, {0.4, 0.6, 0}, {0, 1, 0}}}};
    ReachProof proof;
    CHECK(proof.holds(whole, halves, 1.0e-12));
    CHECK(proof.used() == std::vector<std::uint8_t>{1, 1});
    CHECK(proof.bound_m() <= 1.0e-12);
    CHECK_FALSE(proof.holds(whole, std::span(halves).first(1), 0.3));
    // The largest gap is inside, where no corner is.
    halves[1][0] = {0.0, 0.2, 0};
    const double gap = sampled_distance({whole}, halves, 200);
    CHECK(gap > 0.05);
    CHECK_FALSE(proof.holds(whole, halves, 0.99 * gap));
    CHECK(proof.holds(whole, halves, 1.02 * gap));
    for (FaceTriangle& t : halves) {
      for (Point3& p : t) p[2] += 0.01;
    }
    CHECK_FALSE(proof.holds(whole, halves, 0.0099));
  }

  TEST_CASE("flat sides go to one facet each at the smallest tolerance") {
    const RawMesh raw = grid_box(8);
    SurfaceOptions as_triangles;
    as_triangles.merge = false;
    EdgeCollapse collapse(triangle_mesh(make_surface_part(raw, as_triangles)));
    CHECK(collapse.triangles() == 768);
    collapse.run(1.0e-9, 0, {});
    CHECK(collapse.triangles() == 12);
    const CollapseAccount account = collapse.account();
    CHECK(account.hausdorff_m() < 1.0e-9);
    const TriangleMesh mesh = collapse.result();
    Triangles result;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) result.push_back(mesh.corners(i));
    CHECK(objection(triangles_of_part(part_of(raw)), result, account, 6) == "");
    // Merging alone leaves as few facets: nothing is simplified.
    const SimplifiedPart out = simplified(raw, 1.0e-9);
    CHECK_FALSE(out.collapsed.changed());
    CHECK(out.part.facets.size() == 6);
    CHECK(out.part.closed);
  }

  TEST_CASE("a cylinder of 256 segments has the fewer the larger the tolerance") {
    const double r = 0.01;
    const RawMesh raw = shape_mesh(CylinderShape{r, 0.02, 256}, "cylinder");
    const Triangles given = triangles_of_part(part_of(raw));
    std::size_t before = part_of(raw).facets.size();
    for (const double tolerance : {1.0e-5, 1.0e-4, 5.0e-4}) {
      CAPTURE(tolerance);
      const SimplifiedPart out = simplified(raw, tolerance);
      // Segments whose chords stay within the tolerance, and up to twice as many by collapses in
      // halves; two ends.
      const double least = std::numbers::pi / std::acos(1.0 - tolerance / r);
      CHECK(out.part.facets.size() < before);
      CHECK(static_cast<double>(out.part.facets.size()) < 4.0 * least + 8.0);
      CHECK(static_cast<double>(out.part.facets.size()) > 0.5 * least);
      before = out.part.facets.size();
      CHECK(out.collapsed.hausdorff_m() <= tolerance);
      CHECK(topology_of(out.part).euler == 2);
      CHECK(topology_of(out.part).closed);
      CHECK(out.found.self_intersections == 0U);
      CHECK(objection(given, triangles_of_part(out.part), out.collapsed, 2) == "");
    }
  }

  TEST_CASE("the judge objects to a certificate of another surface") {
    const RawMesh raw = shape_mesh(SphereShape{0.01, 24}, "sphere");
    const Triangles given = triangles_of_part(part_of(raw));
    const SimplifiedPart out = simplified(raw, 4.0e-4);
    Triangles result = triangles_of_part(out.part);
    REQUIRE(out.collapsed.changed());
    CHECK(objection(given, result, out.collapsed, 6) == "");
    // One corner off by two tolerances.
    const Point3 corner = result[0][0];
    for (FaceTriangle& t : result) {
      for (Point3& p : t) {
        if (p == corner) p = vec::add(p, vec::scaled(vec::unit(p), 8.0e-4));
      }
    }
    CHECK(objection(given, result, out.collapsed, 6) != "");
    // A triangle left out.
    result = triangles_of_part(out.part);
    result.pop_back();
    CHECK(objection(given, result, out.collapsed, 6) == "given to result");
    // A figure too small.
    CollapseAccount doctored = out.collapsed;
    doctored.given_to_result_m *= 0.2;
    CHECK(objection(given, triangles_of_part(out.part), doctored, 6) == "given to result");
  }

  TEST_CASE("a bore that would close is refused with its place; below that it stays open") {
    const RawMesh raw = shape_mesh(TubeShape{0.002, 0.01, 0.02, 32}, "tube");
    const std::string text = refusal_of(raw, 0.0025);
    CHECK(contains(text, "tube: tolerance_m 0.0025 would close a hole or gap of 0.004 m near ("));
    CHECK(contains(text, "give tolerance_m below 0.002, or leave it out"));
    for (const double tolerance : {1.0e-4, 1.0e-3, 1.9e-3}) {
      CAPTURE(tolerance);
      const SimplifiedPart out = simplified(raw, tolerance);
      CHECK(topology_of(out.part).euler == 0);
      CHECK(topology_of(out.part).closed);
      CHECK(out.found.self_intersections == 0U);
      CHECK(out.collapsed.hausdorff_m() <= tolerance);
      CHECK(objection(triangles_of_part(part_of(raw)), triangles_of_part(out.part), out.collapsed,
                      8) == "");
    }
    const RawMesh thin = shape_mesh(TubeShape{0.0096, 0.01, 0.02, 64}, "thin");
    CHECK(contains(refusal_of(thin, 3.0e-4), "would close a wall of 0.000388 m near ("));
    CHECK(refusal_of(thin, 1.0e-4) == "");
  }

  TEST_CASE("a passage is found where two facets overlap a little, far from their middles") {
    // Sheets of two triangles, one above the other; they share a tenth of their width.
    MeshBuilder m;
    const auto sheet = [&](double x, double y, double z) {
      const std::uint32_t a = m.vertex({x, y, z}), b = m.vertex({x + 1.0, y, z}),
                          c = m.vertex({x + 1.0, y + 1.0, z}), d = m.vertex({x, y + 1.0, z});
      m.face({a, b, c, d});
    };
    sheet(0.0, 0.0, 0.0);
    sheet(0.9, 0.8, 0.01);
    SurfaceOptions as_triangles;
    as_triangles.merge = false;
    const TriangleMesh mesh = triangle_mesh(make_surface_part(m.raw(), as_triangles));
    const auto passage = narrowest_passage(mesh, false, 1.0e-6, 0.02);
    REQUIRE(passage);
    CHECK(passage->width_m == doctest::Approx(0.01));
    CHECK(passage->at[0] > 0.9 - 1e-9);
    CHECK(passage->at[1] > 0.8 - 1e-9);
    CHECK(passage->at[2] == doctest::Approx(0.005));
    CHECK_FALSE(narrowest_passage(mesh, false, 1.0e-6, 0.0099));
    CHECK_FALSE(narrowest_passage(mesh, false, 0.011, 0.02));
    // Side by side, not above each other.
    MeshBuilder apart;
    std::swap(m, apart);
    sheet(0.0, 0.0, 0.0);
    sheet(1.0, 0.0, 0.01);
    const TriangleMesh steps = triangle_mesh(make_surface_part(m.raw(), as_triangles));
    CHECK_FALSE(narrowest_passage(steps, false, 1.0e-6, 0.02));
  }

  TEST_CASE("the hole in a sheet is a passage, across it and not along its border") {
    // Four strips round a square hole of 2 mm in a sheet of 20 mm.
    const auto framed = [](double half) {
      MeshBuilder m;
      const double far = 0.01;
      std::array<std::uint32_t, 4> out{}, in{};
      for (std::size_t k = 0; k < 4; ++k) {
        const double x = k == 0 || k == 3 ? -1 : 1, y = k < 2 ? -1 : 1;
        out[k] = m.vertex({x * far, y * far, 0});
        in[k] = m.vertex({x * half, y * half, 0});
      }
      for (std::size_t k = 0; k < 4; ++k) {
        m.face({out[k], out[(k + 1) % 4], in[(k + 1) % 4], in[k]});
      }
      return m.raw();
    };
    SurfaceOptions as_triangles;
    as_triangles.merge = false;
    const TriangleMesh mesh = triangle_mesh(make_surface_part(framed(0.001), as_triangles));
    const auto passage = narrowest_passage(mesh, false, 1.0e-6, 0.0022);
    REQUIRE(passage);
    CHECK(passage->width_m == doctest::Approx(0.002));
    CHECK(std::abs(passage->at[0]) + std::abs(passage->at[1]) < 0.0011);
    CHECK_FALSE(passage->is_wall);
    CHECK_FALSE(narrowest_passage(mesh, false, 1.0e-6, 0.00199));
    CHECK(contains(refusal_of(framed(0.001), 1.1e-3), "would close a hole or gap of 0.002 m near"));
    CHECK(refusal_of(framed(0.001), 0.9e-3) == "");
  }

  TEST_CASE("a thread keeps its shape: closed, one ball or ring, no triangles that cross") {
    const double pitch = 0.002, diameter = 0.016;
    for (const bool internal : {false, true}) {
      CAPTURE(internal);
      const RawMesh raw = shape_mesh(
          ThreadShape{diameter, pitch, 2.0, internal, internal ? 0.012 : 0.0, 0.0, 48}, "thread");
      const SimplifiedPart out = simplified(raw, 1.0e-4);
      CHECK(out.collapsed.triangles_after < out.collapsed.triangles_before * 3 / 5);
      CHECK(topology_of(out.part).euler == (internal ? 0 : 2));
      CHECK(topology_of(out.part).closed);
      CHECK(out.found.self_intersections == 0U);
      CHECK(objection(triangles_of_part(part_of(raw)), triangles_of_part(out.part), out.collapsed,
                      2) == "");
    }
  }

  TEST_CASE("a sheet stays a sheet, its border within the tolerance") {
    const RawMesh raw = saddle(24, 0.004);
    const Triangles given = triangles_of_part(part_of(raw));
    const SimplifiedPart out = simplified(raw, 1.0e-4);
    CHECK(out.collapsed.triangles_after < 400);
    CHECK(out.found.open_edges > 3);
    CHECK(out.found.open_edges < 96);
    CHECK(topology_of(out.part).euler == 1);
    CHECK(objection(given, triangles_of_part(out.part), out.collapsed, 6) == "");
    // The bound of the branch and bound that solids use, which knows nothing of collapses.
    DistanceLimits limits;
    limits.relative = 0.01;
    const SurfaceDistance apart = hausdorff_distance(given, triangles_of_part(out.part), limits);
    CHECK(apart.at_least_m <= out.collapsed.hausdorff_m());
    CHECK(apart.at_most_m <= 1.0e-4 * 1.02);
  }

  TEST_CASE("seams that no triangle shares are left as they are") {
    // Two strips whose common border has a corner on one side only (T-junctions).
    MeshBuilder m;
    const int n = 8;
    for (int i = 0; i <= n; ++i) {
      m.vertex({0.01 * i / n, 0.0, 0.0});
      m.vertex({0.01 * i / n, -0.005, 0.001 * (i % 2)});
    }
    for (std::uint32_t i = 0; i < n; ++i) m.face({2 * i, 2 * i + 1, 2 * i + 3, 2 * i + 2});
    const std::uint32_t first = m.vertex({0.0, 0.0, 0.0}), second = m.vertex({0.01, 0.0, 0.0});
    const std::uint32_t third = m.vertex({0.01, 0.005, 0.003}),
                        last = m.vertex({0.0, 0.005, 0.003});
    m.face({first, second, third, last});
    const RawMesh raw = m.raw();
    SurfaceAccount account;
    make_surface_part(raw, {}, &account);
    REQUIRE(account.t_junction_edges > 0);
    const SimplifiedPart out = simplified(raw, 1.5e-3);
    CHECK(out.collapsed.changed());
    // No seam opens; corners that have become straight in all facets go by merging.
    CHECK(out.found.t_junction_edges > 1);
    CHECK(out.found.open_edges <= account.open_edges);
    CHECK_FALSE(out.found.widest_crack_m > 0.0);
    CHECK(objection(triangles_of_part(part_of(raw)), triangles_of_part(out.part), out.collapsed,
                    8) == "");
  }

  TEST_CASE("equal input gives equal bits, and a larger tolerance goes on from a smaller one") {
    const RawMesh raw = shape_mesh(SphereShape{0.01, 24}, "sphere");
    const SimplifiedPart first = simplified(raw, 8.0e-4), second = simplified(raw, 8.0e-4);
    CHECK(first.part.vertices_m == second.part.vertices_m);
    CHECK(first.collapsed.given_to_result_m == second.collapsed.given_to_result_m);
    SurfaceOptions as_triangles;
    as_triangles.merge = false;
    EdgeCollapse collapse(triangle_mesh(make_surface_part(raw, as_triangles)));
    std::size_t before = collapse.triangles();
    for (const double tolerance : {4.0e-4, 8.0e-4, 2.0e-3}) {
      collapse.run(tolerance, 0, {});
      CHECK(collapse.triangles() < before);
      before = collapse.triangles();
      const CollapseAccount account = collapse.account();
      CHECK(account.hausdorff_m() <= tolerance);
      const TriangleMesh result = collapse.result();
      Triangles triangles;
      for (std::size_t i = 0; i < result.triangles.size(); ++i) {
        triangles.push_back(result.corners(i));
      }
      CHECK(objection(triangles_of_part(part_of(raw)), triangles, account, 5) == "");
    }
  }

  TEST_CASE("far from the origin and at any size the proof holds or nothing is done") {
    RawMesh raw = grid_box(4);
    for (Point3& p : raw.vertices) p[0] += 1000.0;
    CHECK_FALSE(simplified(raw, 1.0e-12).collapsed.changed());
    CHECK(simplified(raw, 1.0e-6).part.facets.size() == 6);
    SurfaceOptions options;
    options.scale_to_m = {1.0e-6, 1.0e-6, 1.0e-6};
    CHECK(simplified_surface(grid_box(4), options, 1.0e-13, {}).part.facets.size() == 6);
  }
}
