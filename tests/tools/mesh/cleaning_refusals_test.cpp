// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/tools/mesh/mesh_builder.hpp"

namespace haptic::tools::test {
namespace {

MeshBuilder box_at(const Point3& low) {
  MeshBuilder mesh;
  mesh.box(low, {low[0] + 1, low[1] + 1, low[2] + 1});
  return mesh;
}

}  // namespace

TEST_SUITE("tools.mesh_cleaning") {
  TEST_CASE("open: number of edges, place of the longest hole in the file frame") {
    MeshBuilder mesh = box_at({100, 200, 300});
    mesh.faces.erase(mesh.faces.begin() + 1);  // the top, z = 301
    mesh.box({110, 200, 300}, {111, 201, 301});
    mesh.faces[5] = {mesh.faces[5][0], mesh.faces[5][1], mesh.faces[5][2]};
    const std::string text = refusal(mesh.raw());
    CHECK(contains(text,
                   "built.obj: open: 7 edges without a partner, longest hole at (100.5, "
                   "200.5, 301) m (4 edges, 4 m, next to face"));
    CHECK(contains(text, "; close the hole in the CAD program; T-junctions were already stitched"));
  }

  TEST_CASE("open: places follow the scale") {
    MeshBuilder mesh = box_at({0, 0, 0});
    mesh.faces.erase(mesh.faces.begin() + 1);
    CHECK(contains(refusal(mesh.raw(), {.scale_to_m = {0.001, 0.002, 0.003}}),
                   "at (0.0005, 0.001, 0.003) m"));
  }

  TEST_CASE("open: a flap on a solid") {
    MeshBuilder mesh = box_at({0, 0, 0});
    mesh.face({6, 7, mesh.vertex({0.5, 1, 2})});
    CHECK(contains(refusal(mesh.raw()), "open: 2 edges without a partner"));
  }

  TEST_CASE("edge with an odd number of faces") {
    MeshBuilder mesh = box_at({0, 0, 0});
    mesh.face({0, 3, 7, 4});  // a diagonal wall
    mesh.faces[0] = {0, 2, 3};
    mesh.face({0, 3, 1});
    mesh.faces[1] = {4, 5, 7};
    mesh.face({4, 7, 6});
    const std::string text = refusal(mesh.raw());
    CHECK(contains(text, "edge with 3 faces at (0"));
    CHECK(contains(text, "separate the solids that touch there, or give them as separate groups"));
  }

  TEST_CASE("edge with four faces that do not alternate") {
    // Two wedges with a common edge that overlap, in one part.
    MeshBuilder mesh;
    const std::uint32_t a = mesh.vertex({0, 0, 0});
    const std::uint32_t b = mesh.vertex({0, 0, 1});
    const auto wedge = [&](double from, double to) {
      const std::uint32_t c = mesh.vertex({std::cos(from), std::sin(from), 0.5});
      const std::uint32_t d = mesh.vertex({std::cos(to), std::sin(to), 0.5});
      mesh.face({a, c, b});
      mesh.face({a, b, d});
      mesh.face({a, d, c});
      mesh.face({b, c, d});
    };
    wedge(0.0, 1.5);
    wedge(0.7, 2.2);
    const std::string text = refusal(mesh.raw());
    CHECK(contains(text, "edge with 4 faces at (0, 0, 0.5) m, not alternating"));
    mesh.unshare();
    std::fill(mesh.groups.begin() + 4, mesh.groups.end(), 1U);
    CHECK(refusal(mesh.raw()) == "");
    CHECK(clean(mesh.raw()).solid_count == 2);
  }

  TEST_CASE("one-sided surface") {
    // The Klein bottle as a grid of quads; it passes through itself, which is not what is tested
    // here.
    MeshBuilder mesh;
    const std::uint32_t n = 8;
    for (std::uint32_t i = 0; i < n; ++i) {
      for (std::uint32_t j = 0; j < n; ++j) {
        const double u = 6.283185307179586 * i / n;
        const double v =
            6.283185307179586 * (j + 0.5) / n;  // off the curve where it crosses itself
        const double r = 4 + std::cos(u / 2) * std::sin(v) - std::sin(u / 2) * std::sin(2 * v);
        mesh.vertex({r * std::cos(u), r * std::sin(u),
                     std::sin(u / 2) * std::sin(v) + std::cos(u / 2) * std::sin(2 * v)});
      }
    }
    const auto at = [&](std::uint32_t i, std::uint32_t j) {
      return i < n ? i * n + j % n : (2 * n - 1 - j) % n;  // the seam is mirrored
    };
    for (std::uint32_t i = 0; i < n; ++i) {
      for (std::uint32_t j = 0; j < n; ++j) {
        mesh.face({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
        mesh.face({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
      }
    }
    const std::string text = refusal(mesh.raw());
    CAPTURE(text);
    CHECK(contains(text, "cannot be oriented: the surface is one-sided"));
    CHECK(contains(text, "face "));
  }

  TEST_CASE("sheets and thin walls, with the place") {
    MeshBuilder sheet;
    sheet.box({0, 0, 0}, {1, 1, 1.0e-6});
    CHECK(contains(refusal(sheet.raw()), "thinner than the plane tolerance"));
    for (const double thickness : {1.0e-5, 5.0e-5}) {
      MeshBuilder thin;
      thin.box({5, 0, 0}, {6, 1, thickness});
      const std::string text = refusal(thin.raw());
      CHECK(contains(text, "thinner than the plane tolerance"));
      CHECK(contains(text, "at (5, 0, 0) m"));
      CHECK(contains(text, "--plane-tolerance"));
      CHECK(refusal(thin.raw(), {.plane_tolerance_m = 1.0e-7}) == "");
    }
    MeshBuilder thick;
    thick.box({0, 0, 0}, {1, 1, 1.0e-3});
    CHECK(refusal(thick.raw()) == "");
  }

  TEST_CASE("a flat double-sided sheet is no solid") {
    MeshBuilder mesh;
    mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    mesh.face({0, 1, 2, 3});
    mesh.face({3, 2, 1, 0});
    CHECK(refusal(mesh.raw()) != "");
  }

  TEST_CASE("polygons that cross themselves or have a bridged hole") {
    MeshBuilder mesh = box_at({0, 0, 0});
    std::swap(mesh.faces[2][0], mesh.faces[2][1]);
    CHECK(contains(refusal(mesh.raw()), "face 3 (line 3) at"));
    CHECK(contains(refusal(mesh.raw()), "crosses itself (bow-tie); split the face into triangles"));

    MeshBuilder bridged = box_at({0, 0, 0});
    const std::uint32_t h = bridged.vertex({0.3, 0.3, 1});
    bridged.vertex({0.3, 0.6, 1});
    bridged.vertex({0.6, 0.6, 1});
    bridged.faces[1] = {4, 5, 7, 6, 4, h, h + 1, h + 2, h};
    CHECK(contains(refusal(bridged.raw()), "has a hole bridged into it"));
  }

  TEST_CASE("size out of range names the limit") {
    const RawMesh raw = box_at({0, 0, 0}).raw();
    CHECK(contains(refusal(raw, {.scale_to_m = {1e-7, 1e-7, 1e-7}}),
                   "the part is 1.73e-07 m across, smallest 1e-06 m; check the scale"));
    CHECK(contains(refusal(raw, {.scale_to_m = {1e5, 1e5, 1e5}}), "largest 1e+04 m"));
    CHECK(refusal(raw, {.scale_to_m = {1e-6, 1e-6, 1e-6}}) == "");
    CHECK(refusal(raw, {.scale_to_m = {5e3, 5e3, 5e3}}) == "");
  }

  TEST_CASE("options out of range") {
    const RawMesh raw = box_at({0, 0, 0}).raw();
    const double nan = std::numeric_limits<double>::quiet_NaN();
    for (const double bad : {0.0, -1.0, nan}) {
      CHECK(contains(refusal(raw, {.scale_to_m = {1.0, bad, 1.0}}), "not three positive numbers"));
      CHECK(contains(refusal(raw, {.plane_tolerance_m = bad}), "the plane tolerance"));
    }
    CHECK(contains(refusal(raw, {.plane_tolerance_m = 0.1}), "is out of range"));
    CHECK(contains(refusal(raw, {.scale_to_m = {1e308, 1e308, 1e308}}), "across, largest"));
  }

  TEST_CASE("hostile raw meshes") {
    CHECK(contains(refusal(RawMesh{}), "the mesh has no face"));
    RawMesh raw = box_at({0, 0, 0}).raw();
    raw.faces[0].vertices[0] = 99;
    CHECK(contains(refusal(raw), "uses vertex 99 of 8"));
  }
}

}  // namespace haptic::tools::test
