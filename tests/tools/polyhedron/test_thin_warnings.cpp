// SPDX-License-Identifier: Apache-2.0
/// What is accepted, but said: planes that are almost one, and pieces that are almost nothing.
#include <doctest/doctest.h>

#include <string>

#include "tests/tools/polyhedron/flatten_parts.hpp"
#include "tests/tools/polyhedron/part_surface.hpp"
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

TEST_SUITE("tools.thin_warnings") {
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
