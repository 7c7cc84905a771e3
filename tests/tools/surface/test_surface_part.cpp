// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "tests/support/random.hpp"
#include "tests/tools/mesh/mesh_builder.hpp"
#include "tests/tools/surface/surface_promises.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"
#include "tools/graph_compiler/surface/surface_part.hpp"

using namespace haptic::tools;
using namespace haptic::tools::test;
using haptic::test::Random;

namespace {

struct Made {
  SurfacePart part;
  SurfaceAccount account;
};

Made made(const RawMesh& raw, SurfaceOptions options = {}) {
  Made m;
  m.part = make_surface_part(raw, options, &m.account);
  CHECK(broken_promise(m.part, m.account.diagonal_m) == "");
  return m;
}

std::string refused(const RawMesh& raw, const SurfaceOptions& options = {}) {
  try {
    make_surface_part(raw, options);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

MeshBuilder box_mesh() {
  MeshBuilder m;
  m.box({0, 0, 0}, {2, 1, 1});
  return m;
}

/// An upright prism over an outline, counter-clockwise, caps as one polygon each.
MeshBuilder prism_mesh(const std::vector<std::array<double, 2>>& outline, double height) {
  MeshBuilder m;
  const auto n = static_cast<std::uint32_t>(outline.size());
  for (const double z : {0.0, height}) {
    for (const auto& [x, y] : outline) m.vertex({x, y, z});
  }
  std::vector<std::uint32_t> low, high;
  for (std::uint32_t k = 0; k < n; ++k) {
    m.face({k, (k + 1) % n, n + (k + 1) % n, n + k});
    low.push_back(n - 1 - k);
    high.push_back(n + k);
  }
  m.face(low);
  m.face(high);
  return m;
}

MeshBuilder ell() { return prism_mesh({{0, 0}, {3, 0}, {3, 1}, {1, 1}, {1, 3}, {0, 3}}, 1.0); }

/// The same with caps of two convex polygons each.
MeshBuilder ell_of_quads() {
  MeshBuilder m = ell();
  m.faces.resize(6);
  m.groups.resize(6);
  for (const auto& cap :
       {std::vector<std::uint32_t>{3, 2, 1, 0}, {5, 4, 3, 0}, {6, 7, 8, 9}, {6, 9, 10, 11}}) {
    m.face(cap);
  }
  return m;
}

MeshBuilder tube(std::uint32_t n) {
  MeshBuilder m;
  for (const double z : {0.0, 2.0}) {
    for (const double r : {1.0, 0.6}) {
      for (std::uint32_t k = 0; k < n; ++k) {
        const double a = 2.0 * std::numbers::pi * k / n;
        m.vertex({r * std::cos(a), r * std::sin(a), z});
      }
    }
  }
  for (std::uint32_t k = 0; k < n; ++k) {
    const std::uint32_t l = (k + 1) % n;
    m.face({k, l, 2 * n + l, 2 * n + k});                  // outside
    m.face({n + l, n + k, 3 * n + k, 3 * n + l});          // inside
    m.face({l, k, n + k, n + l});                          // bottom
    m.face({2 * n + k, 2 * n + l, 3 * n + l, 3 * n + k});  // top
  }
  return m;
}

void cut_into_triangles(MeshBuilder& m) {
  std::vector<std::vector<std::uint32_t>> faces;
  for (const std::vector<std::uint32_t>& f : m.faces) {
    if (f.size() != 4 && f.size() != 3) {
      faces.push_back(f);
      continue;
    }
    for (std::size_t k = 1; k + 1 < f.size(); ++k) faces.push_back({f[0], f[k], f[k + 1]});
  }
  m.faces = faces;
  m.groups.assign(faces.size(), 0);
}

double area_of(const SurfacePart& part) {
  double area = 0.0;
  for (const SurfacePart::Facet& facet : part.facets) {
    area += 0.5 * vec::norm(vec::twice_area(part.vertices_m, facet.loop));
  }
  return area;
}

/// One good mesh with up to four kinds of damage.
MeshBuilder damaged(Random& random, bool& soup) {
  const auto pick = [&](std::size_t n) { return static_cast<std::size_t>(random.next() % n); };
  MeshBuilder m;
  switch (pick(3)) {
    case 0:
      m = box_mesh();
      break;
    case 1:
      m = ell_of_quads();
      break;
    default:
      m = tube(static_cast<std::uint32_t>(4 + pick(9)));
      break;
  }
  if (pick(4) != 0) cut_into_triangles(m);
  soup = pick(2) == 0;
  if (soup) m.unshare();
  for (std::size_t round = 1 + pick(4); round > 0; --round) {
    const std::size_t kind = pick(7), f = pick(m.faces.size());
    std::vector<std::uint32_t> loop = m.faces[f];
    if (kind == 0 && m.faces.size() > 3) {  // a hole
      m.faces.erase(m.faces.begin() + static_cast<std::ptrdiff_t>(f));
      m.groups.pop_back();
    } else if (kind == 1) {  // turned
      std::reverse(m.faces[f].begin(), m.faces[f].end());
    } else if (kind == 2) {  // given twice
      if (pick(2) == 0) std::reverse(loop.begin(), loop.end());
      m.face(loop);
    } else if (kind == 3) {  // noise
      for (Point3& p : m.vertices) {
        for (double& x : p) x += random.uniform(-1e-6, 1e-6);
      }
    } else if (kind == 4) {  // a crack
      for (std::uint32_t& v : m.faces[f]) {
        Point3 p = m.vertices[v];
        p[pick(3)] += random.uniform(-1e-3, 1e-3);
        v = m.vertex(p);
      }
    } else if (kind == 5) {  // a T-junction: one face is split, its neighbour is not
      const Point3 middle = vec::scaled(vec::add(m.vertices[loop[0]], m.vertices[loop[1]]), 0.5);
      const std::uint32_t v = m.vertex(middle);
      m.faces[f] = {v, loop[1], loop[2]};
      std::vector<std::uint32_t> rest{loop[0], v};
      rest.insert(rest.end(), loop.begin() + 2, loop.end());
      m.face(rest);
    } else {  // a triangle without area along a side
      const Point3 at =
          vec::add(vec::scaled(m.vertices[loop[0]], 0.25), vec::scaled(m.vertices[loop[1]], 0.75));
      m.face({loop[0], m.vertex(at), loop[1]});
    }
  }
  return m;
}

void check_damaged(std::uint64_t seeds) {
  std::size_t accepted = 0;
  for (std::uint64_t seed = 0; seed < seeds; ++seed) {
    CAPTURE(seed);
    Random random(seed);
    bool soup = false;
    const MeshBuilder mesh = damaged(random, soup);
    const RawMesh raw = mesh.raw(!soup);
    SurfaceOptions options;
    const double scale = std::pow(10.0, random.uniform(-4, 3));
    options.scale_to_m = {scale, scale, scale};
    SurfacePart part;
    SurfaceAccount account;
    try {
      part = make_surface_part(raw, options, &account);
    } catch (const InputError& error) {
      FAIL("seed " << seed << " refused: " << error.what());
    }
    ++accepted;
    REQUIRE(broken_promise(part, account.diagonal_m) == "");
    // Bent polygons may be cut along another diagonal than the fan of the oracle: by the noise.
    const double bent = 3e-3 * scale;
    const double tight = account.largest_weld_move_m + 1e-11 * account.diagonal_m;
    bool flat = true;
    for (const RawFace& face : raw.faces) flat = flat && face.vertices.size() == 3;
    REQUIRE(set_distance(part, raw, scale, seed) <= (flat ? tight : bent));
    REQUIRE(account.largest_weld_move_m <= account.weld_radius_m);
    // The same with triangles kept: another cut of the same set.
    options.merge = false;
    const SurfacePart triangles = make_surface_part(raw, options);
    REQUIRE(broken_promise(triangles, account.diagonal_m) == "");
    REQUIRE(area_of(triangles) == doctest::Approx(area_of(part)).epsilon(1e-9));
    REQUIRE(triangles.facets.size() == account.triangles);
  }
  CHECK(accepted == seeds);
}

}  // namespace

TEST_SUITE("tools.surface_part") {
  TEST_CASE("a box becomes six squares of eight vertices, however it is cut and repeated") {
    for (const bool triangles : {false, true}) {
      for (const bool soup : {false, true}) {
        MeshBuilder m = box_mesh();
        if (triangles) cut_into_triangles(m);
        if (soup) m.unshare();
        const Made b = made(m.raw(!soup));
        CHECK(b.part.facets.size() == 6);
        CHECK(b.part.vertices_m.size() == 8);
        CHECK(b.part.edges.size() == 12);
        CHECK(b.part.inward.size() == 24);
        CHECK(b.part.ring.size() == 24);
        CHECK(b.part.closed);
        CHECK(b.account.closed_shells == 1);
        CHECK(b.account.tight);
        CHECK(b.account.open_edges == 0);
        CHECK(area_of(b.part) == doctest::Approx(10.0));
      }
    }
  }

  TEST_CASE("a flat face with a reflex corner is cut into convex facets") {
    const Made l = made(ell().raw());
    CHECK(l.part.closed);
    CHECK(l.part.facets.size() == 10);  // six walls, two rectangles or trapezia each for the caps
    CHECK(area_of(l.part) == doctest::Approx(2 * 5.0 + 12.0));
  }

  TEST_CASE("triangles are kept on demand, and facets have no more corners than allowed") {
    SurfaceOptions options;
    options.merge = false;
    CHECK(made(tube(12).raw(), options).part.facets.size() == 96);
    options.merge = true;
    std::vector<std::array<double, 2>> outline;
    for (int k = 0; k < 60; ++k) {
      const double a = 2.0 * std::numbers::pi * k / 60;
      outline.push_back({std::cos(a), std::sin(a)});
    }
    const RawMesh disc = prism_mesh(outline, 1.0).raw();
    std::size_t largest = 0;
    for (const SurfacePart::Facet& f : made(disc, options).part.facets) {
      largest = std::max(largest, f.loop.size());
    }
    CHECK(largest > 12);
    CHECK(largest <= 24);
    options.most_corners = 4;
    for (const SurfacePart::Facet& f : made(disc, options).part.facets) CHECK(f.loop.size() <= 4);
  }

  TEST_CASE("many coplanar triangles become few facets, without corners inside sides") {
    MeshBuilder m;
    constexpr std::uint32_t n = 12;
    for (std::uint32_t i = 0; i <= n; ++i) {
      for (std::uint32_t k = 0; k <= n; ++k) {
        m.vertex({static_cast<double>(i), static_cast<double>(k), 0.0});
      }
    }
    for (std::uint32_t i = 0; i < n; ++i) {
      for (std::uint32_t k = 0; k < n; ++k) {
        const std::uint32_t v = i * (n + 1) + k;
        m.face({v, v + n + 1, v + n + 2});
        m.face({v, v + n + 2, v + 1});
      }
    }
    const Made sheet = made(m.raw());
    CHECK(sheet.account.triangles == 288);
    CHECK(sheet.part.facets.size() <= 12);
    CHECK(area_of(sheet.part) == doctest::Approx(144.0));
    CHECK(sheet.account.t_junction_edges == 0);
    CHECK_FALSE(sheet.part.closed);
  }

  TEST_CASE("open edges have one inward direction, non-manifold edges one for each facet") {
    MeshBuilder m;
    const std::uint32_t a = m.vertex({0, 0, 0}), b = m.vertex({1, 0, 0});
    for (const Point3& p : {Point3{0, 1, 0}, Point3{0, -1, 0}, Point3{0, 0, 1}}) {
      m.face({a, b, m.vertex(p)});
    }
    const Made fins = made(m.raw());
    CHECK(fins.account.nonmanifold_edges == 1);
    CHECK(fins.account.open_edges == 6);
    for (std::size_t e = 0; e < fins.part.edges.size(); ++e) {
      const bool common = fins.part.edges[e] == std::array<std::uint32_t, 2>{0, 1};
      CHECK(fins.part.inward_begin[e + 1] - fins.part.inward_begin[e] == (common ? 3u : 1u));
    }
  }

  TEST_CASE("T-junction: both sides of the seam know each other, and the vertex in between") {
    MeshBuilder m;  // one square below, two above; nothing shared
    m.face({m.vertex({0, 0, 0}), m.vertex({2, 0, 0}), m.vertex({2, 1, 0}), m.vertex({0, 1, 0})});
    const std::uint32_t t = m.vertex({1, 1, 0});
    m.face({m.vertex({0, 1, 0}), t, m.vertex({1, 2, 0}), m.vertex({0, 2, 0})});
    m.face({t, m.vertex({2, 1, 0}), m.vertex({2, 2, 0}), m.vertex({1, 2, 0})});
    SurfaceOptions options;
    options.merge = false;
    const Made seam = made(m.raw(), options);
    CHECK(seam.account.t_junction_edges == 3);
    CHECK(seam.account.open_edges == 7);
    std::size_t with_two = 0;
    for (std::size_t e = 0; e < seam.part.edges.size(); ++e) {
      const Point3& p = seam.part.vertices_m[seam.part.edges[e][0]];
      const Point3& q = seam.part.vertices_m[seam.part.edges[e][1]];
      if (std::abs(p[1] - 1.0) > 0.0 || std::abs(q[1] - 1.0) > 0.0) continue;
      ++with_two;
      REQUIRE(seam.part.inward_begin[e + 1] - seam.part.inward_begin[e] == 2);
      const std::size_t i = seam.part.inward_begin[e];
      CHECK(vec::dot(seam.part.inward[i], seam.part.inward[i + 1]) == doctest::Approx(-1.0));
    }
    CHECK(with_two == 3);
    for (std::size_t v = 0; v < seam.part.vertices_m.size(); ++v) {
      if (vec::distance(seam.part.vertices_m[v], {1, 1, 0}) > 0.0) continue;
      // No normal in the plane can carry force there: the directions go all around.
      bool down = false;
      for (std::size_t i = seam.part.ring_begin[v]; i < seam.part.ring_begin[v + 1]; ++i) {
        down = down || seam.part.ring[i][1] < -0.5;
      }
      CHECK(down);
    }
  }

  TEST_CASE("a seam divided differently is tight, unless one side of it is turned or missing") {
    MeshBuilder m = box_mesh();
    const std::vector<std::uint32_t> top = m.faces[1];
    const Point3 middle = vec::scaled(vec::add(m.vertices[top[0]], m.vertices[top[1]]), 0.5);
    const std::uint32_t v = m.vertex(middle);
    m.faces[1] = {top[0], v, top[3]};
    m.face({v, top[1], top[2]});
    m.face({v, top[2], top[3]});
    SurfaceOptions options;
    options.merge = false;
    const Made tight = made(m.raw(), options);
    CHECK(tight.account.t_junction_edges == 3);
    CHECK(tight.account.tight);
    CHECK_FALSE(tight.part.closed);
    MeshBuilder turned = m;
    turned.unshare();
    std::reverse(turned.faces.back().begin(), turned.faces.back().end());
    CHECK(made(turned.raw(false), options).account.tight);  // turned back over its edges
    m.faces.pop_back();
    m.groups.pop_back();
    CHECK_FALSE(made(m.raw(), options).account.tight);
    MeshBuilder sheets;  // two squares, the same sense along the seam
    sheets.face({sheets.vertex({0, 0, 0}), sheets.vertex({2, 0, 0}), sheets.vertex({1, 1, 0})});
    sheets.face({sheets.vertex({0, 0, 0}), sheets.vertex({1, 0, 0}), sheets.vertex({1, 0, 1})});
    CHECK_FALSE(made(sheets.raw(), options).account.tight);
  }

  TEST_CASE("only ends of open edges within the weld radius are joined") {
    MeshBuilder m = box_mesh();
    m.unshare();
    for (std::size_t v = 0; v < 4; ++v) m.vertices[v][2] -= 1e-6;
    const Made joined = made(m.raw(false));
    CHECK(joined.part.closed);
    CHECK(joined.account.largest_weld_move_m == doctest::Approx(1e-6).epsilon(1e-3));
    for (std::size_t v = 0; v < 4; ++v) m.vertices[v][2] -= 1e-4;
    const Made slot = made(m.raw(false));
    CHECK_FALSE(slot.part.closed);
    CHECK(slot.account.open_edges == 8);
    CHECK(slot.account.widest_crack_m == doctest::Approx(1.01e-4).epsilon(1e-3));
  }

  TEST_CASE("a sliver stays, a triangle without area goes where its neighbours cover it") {
    MeshBuilder m;
    const std::uint32_t a = m.vertex({0, 0, 0}), b = m.vertex({2, 0, 0}), c = m.vertex({1, 1, 0}),
                        d = m.vertex({1, -1, 0});
    const std::uint32_t middle = m.vertex({1, 1e-9, 0});
    m.face({a, middle, c});
    m.face({middle, b, c});
    m.face({b, a, d});
    m.face({a, b, middle});
    SurfaceOptions options;
    options.merge = false;
    const Made sliver = made(m.raw(), options);
    CHECK(sliver.account.triangles == 4);
    CHECK(sliver.account.degenerate_absorbed == 0);
    m.vertices[middle][1] = 0.0;
    const Made flat = made(m.raw(), options);
    CHECK(flat.account.triangles == 3);
    CHECK(flat.account.degenerate_absorbed == 1);
    CHECK(flat.account.degenerate_loose == 0);
    CHECK(flat.account.t_junction_edges == 3);
    CHECK(flat.account.open_edges == 4);
    m.face({m.vertex({5, 0, 0}), m.vertex({6, 0, 0}), m.vertex({7, 0, 0})});
    CHECK(made(m.raw(), options).account.degenerate_loose == 1);
  }

  TEST_CASE("repeated faces go, turned faces are turned back, crossings are counted") {
    MeshBuilder m = box_mesh();
    m.face(m.faces[2]);
    std::reverse(m.faces[4].begin(), m.faces[4].end());
    const Made repaired = made(m.raw());
    CHECK(repaired.part.closed);
    CHECK(repaired.account.flipped == 2);
    CHECK(repaired.account.duplicate_facets == 2);
    CHECK(repaired.account.self_intersections == 0);
    MeshBuilder two = box_mesh();
    two.box({1, 0.25, 0.25}, {3, 0.75, 0.75});
    const Made crossing = made(two.raw());
    CHECK(crossing.account.shells == 2);
    REQUIRE(crossing.account.self_intersections.has_value());
    CHECK(*crossing.account.self_intersections > 0);
  }

  TEST_CASE("refused: no face, no area, not finite, a scale that is none") {
    CHECK(contains(refused(MeshBuilder{}.raw()), "no face"));
    MeshBuilder line;
    line.face({line.vertex({0, 0, 0}), line.vertex({1, 0, 0}), line.vertex({2, 0, 0})});
    CHECK(contains(refused(line.raw()), "no triangle has an area"));
    MeshBuilder m = box_mesh();
    m.vertices[3][1] = std::nan("");
    CHECK(contains(refused(m.raw()), "vertex 4 is not finite"));
    SurfaceOptions options;
    options.scale_to_m = {1, -1, 1};
    CHECK(contains(refused(box_mesh().raw(), options), "scale"));
  }

  TEST_CASE("damaged meshes: all accepted, the same set, every promise kept") {
    check_damaged(150);
  }

  TEST_CASE("a thousand damaged meshes: all accepted, the same set, every promise kept [long]") {
    check_damaged(1000);
  }
}
