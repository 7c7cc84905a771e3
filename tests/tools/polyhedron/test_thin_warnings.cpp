// SPDX-License-Identifier: Apache-2.0
/// What is accepted, but said: planes that are almost one, and pieces that are almost nothing.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "tests/tools/polyhedron/flatten_parts.hpp"
#include "tests/tools/polyhedron/part_surface.hpp"
#include "tools/graph_compiler/mesh/cleaning.hpp"
#include "tools/graph_compiler/polyhedron/decomposition.hpp"

namespace haptic::tools {
namespace {

std::string joined(const std::vector<std::string>& warnings) {
  std::string text;
  for (const std::string& warning : warnings) text += warning + "\n";
  return text;
}

/// A block with a step of this height on half of its top.
Surface stepped(double step_m, double tolerance_m) {
  const parts::Part part =
      parts::prism({{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 1 + step_m}, {0, 1 + step_m}}, 0.0, 1.0);
  return parts::surface_of({part}, tolerance_m);
}

/// A block with an upright wall of this thickness on its top: no cut avoids a piece as thin.
Surface finned(double thickness_m, double tolerance_m) {
  const double t = thickness_m;
  const parts::Part part = parts::prism(
      {{0, 0}, {2, 0}, {2, 1}, {1 + t, 1}, {1 + t, 2}, {1, 2}, {1, 1}, {0, 1}}, 0.0, 1.0);
  return parts::surface_of({part}, tolerance_m);
}

/// The corner from which a fan of triangles fills a face.
std::size_t fan_corner(const parts::Part& part, const std::vector<std::uint32_t>& loop) {
  const std::size_t n = loop.size();
  const Point3 area = vec::twice_area(part.vertices, loop);
  for (std::size_t s = 0; s < n; ++s) {
    double least = HUGE_VAL;
    for (std::size_t k = 1; k + 1 < n; ++k) {
      const std::uint32_t corners[3] = {loop[s], loop[(s + k) % n], loop[(s + k + 1) % n]};
      least = std::min(least, vec::dot(area, vec::twice_area(part.vertices, corners)));
    }
    if (least > 0.0) return s;
  }
  FAIL("no fan");
  return 0;
}

/// As a text file in millimetres with so many decimals has the parts, given in millimetres.
RawMesh printed(const std::vector<parts::Part>& all, int decimals, bool triangles) {
  RawMesh raw;
  raw.file = "part.obj";
  raw.indexed = true;
  raw.print_resolution = std::pow(10.0, -decimals);
  std::uint32_t group = 0;
  for (parts::Part part : all) {
    part.print(decimals);
    const auto base = static_cast<std::uint32_t>(raw.vertices.size());
    raw.vertices.insert(raw.vertices.end(), part.vertices.begin(), part.vertices.end());
    for (const auto& loop : part.faces) {
      if (triangles) {
        const std::size_t n = loop.size(), s = fan_corner(part, loop);
        for (std::size_t k = 1; k + 1 < n; ++k) {
          raw.faces.push_back(
              {{base + loop[s], base + loop[(s + k) % n], base + loop[(s + k + 1) % n]}, 0, group});
        }
        continue;
      }
      raw.faces.push_back({{}, 0, group});
      for (const std::uint32_t v : loop) raw.faces.back().vertices.push_back(base + v);
    }
    ++group;
  }
  raw.vertex_places.assign(raw.vertices.size(), 0);
  return raw;
}

Surface printed_surface(const std::vector<parts::Part>& all, int decimals, bool triangles) {
  CleaningOptions options;
  options.scale_to_m = {1e-3, 1e-3, 1e-3};
  return clean_surface(printed(all, decimals, triangles), options);
}

/// Three boxes' worth of a plate, lower by `step_mm` on the middle third, each part convex seen
/// from above: cut into triangles it keeps its shape.
parts::Part stepped_plate(double step_mm, double turn_rad) {
  parts::Part part = parts::prism(
      {{0, 0}, {90, 0}, {90, 10}, {60, 10}, {60, 10 - step_mm}, {0, 10 - step_mm}}, 0.0, 50.0);
  const double c = std::cos(turn_rad), s = std::sin(turn_rad);
  // The steps point along z.
  return part.transform({{{c, 0, s}, {s, 0, -c}, {0, 1, 0}}}, 1.0, {0, 0, 0});
}

TEST_SUITE("tools.thin_warnings") {
  TEST_CASE("planes that the file tells apart stay apart, however few digits it prints") {
    for (const int decimals : {2, 3, 4}) {
      for (const double step_mm : {0.001, 0.003, 0.01, 0.02}) {
        if (step_mm < 0.99 * std::pow(10.0, -decimals)) continue;
        for (const double turn : {0.0, std::numbers::pi / 6}) {
          CAPTURE(decimals);
          CAPTURE(step_mm);
          CAPTURE(turn);
          const Surface surface = printed_surface({stepped_plate(step_mm, turn)}, decimals, false);
          const FlatBody body = flatten(surface, {});
          CHECK(body.merged_plane_count == 8);
          CHECK(body.reflex_edge_count == 1);
          // Of walls that were printed askew alone.
          CHECK(body.largest_move_m <= (turn > 0.0 ? 2e-3 * std::pow(10.0, -decimals) : 1e-12));
        }
      }
    }
  }

  TEST_CASE("a step of the last printed place stays in triangles too, one asked for goes") {
    const parts::Part plate = stepped_plate(0.01, 0.0);
    Surface surface = printed_surface({plate}, 2, true);
    REQUIRE(surface.printed);
    CHECK(surface.plane_tolerance_m > 1e-5);  // of the digits, not of the size
    CHECK(flatten(surface, {}).merged_plane_count == 8);
    // The probe: without the knowledge of the digits, or with a tolerance that somebody gave, the
    // two are one.
    surface.printed.reset();
    CHECK(flatten(surface, {}).merged_plane_count < 8);
    CleaningOptions asked;
    asked.scale_to_m = {1e-3, 1e-3, 1e-3};
    asked.plane_tolerance_m = 1.5e-5;
    const Surface as_asked = clean_surface(printed({plate}, 2, true), asked);
    CHECK(!as_asked.printed);
    CHECK(flatten(as_asked, {}).merged_plane_count < 8);
  }

  TEST_CASE("facets of a round part are no planes that the file has exactly") {
    for (const int segments : {96, 256, 512}) {
      CAPTURE(segments);
      const parts::Part shaft = parts::prism(parts::regular_outline(segments, 50.0), 0.0, 20.0);
      Surface surface = printed_surface({shaft}, 2, false);
      REQUIRE(surface.printed);
      const std::size_t with = flatten(surface, {}).merged_plane_count;
      surface.printed.reset();
      CHECK(with <= flatten(surface, {}).merged_plane_count + 8);
    }
  }

  TEST_CASE("close faces of two shells are said not to be merged only where they are not") {
    // Two plates side by side whose tops differ by less than the tolerance, not by rounding.
    const parts::Part left = parts::box({0, 0, 0}, {40, 30, 10});
    const auto told_of = [&](double top_mm, int decimals) {
      const parts::Part right = parts::box({40, 0, 0}, {80, 30, top_mm});
      const Surface surface = printed_surface({left, right}, decimals, false);
      return joined(flatten(surface, {}).warnings);
    };
    CHECK(told_of(10.01, 2).find("1e-05 m apart at ") != std::string::npos);
    CHECK(told_of(10.01, 2).find("that are not merged") != std::string::npos);
    CHECK(told_of(10.0006, 4).find("that are not merged") != std::string::npos);
    // 0.0002 mm is within 5e-6 of the size: one plane.
    CHECK(told_of(10.0002, 4).find("not merged") == std::string::npos);
  }

  TEST_CASE("planes within ten tolerances that were not joined are reported, with places and fix") {
    const double tolerance = 1.0e-6;
    FlatBody body = flatten(stepped(5 * tolerance, tolerance), {});
    const std::string told = joined(body.warnings);
    CAPTURE(told);
    CHECK(told.find("part.obj: almost equal planes were not joined (faces ") != std::string::npos);
    CHECK(told.find("5e-06 m apart near (") != std::string::npos);
    CHECK(told.find("a larger --plane-tolerance joins them") != std::string::npos);
    CHECK(flatten(stepped(100 * tolerance, tolerance), {}).warnings.empty());
    CHECK(flatten(stepped(0.5 * tolerance, tolerance), {}).merged_plane_count == 6);
  }

  TEST_CASE("a piece below 1e-5 of the size is reported, with its thickness and the fix") {
    FlatBody body = flatten(finned(5.0e-6, 1.0e-8), {});
    const Decomposition thin = decompose(body, "part.obj", {});
    CHECK(thin.certificate.holds());
    const std::string told = joined(thin.warnings);
    CAPTURE(told);
    CHECK(told.find("only 5e-06 m thick") != std::string::npos);
    CHECK(told.find("raise the plane tolerance") != std::string::npos);
    FlatBody thick_body = flatten(finned(1.0e-4, 1.0e-8), {});
    const Decomposition thick = decompose(thick_body, "part.obj", {});
    CHECK(thick.certificate.holds());
    CHECK(thick.warnings.empty());
  }
}

}  // namespace
}  // namespace haptic::tools
