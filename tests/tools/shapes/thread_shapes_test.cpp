// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "tests/tools/mesh/mesh_builder.hpp"
#include "tests/tools/shapes/solid_facts.hpp"
#include "tools/graph_compiler/shapes/fasteners.hpp"
#include "tools/graph_compiler/shapes/shape.hpp"

using namespace haptic::tools;
using namespace haptic::tools::test;

namespace {

/// The true surface of a thread: its radius on the half-plane and height of a point.
struct TrueThread {
  double crest_m, root_m, pitch_m;

  /// Distance along the axis from the middle of the nearest crest [m].
  [[nodiscard]] double from_crest(const Point3& p) const {
    const double z = p[2] - pitch_m * std::atan2(p[1], p[0]) / (2.0 * std::numbers::pi);
    return std::abs(z - pitch_m * std::round(z / pitch_m));
  }
  [[nodiscard]] double radius(const Point3& p) const {
    const double z = from_crest(p);
    if (z <= pitch_m / 16) return crest_m;
    if (z >= pitch_m * 3 / 8) return root_m;
    // Flanks at 30 degrees from the plane across the axis.
    return crest_m - (z - pitch_m / 16) * std::sqrt(3.0);
  }
  [[nodiscard]] bool on_flank(const Point3& p) const {
    const double z = from_crest(p);
    return z > pitch_m / 16 && z < pitch_m * 3 / 8;
  }
};

/// Mean of the square of the radius over a pitch.
double mean_square(const TrueThread& t) {
  const double flank = (t.crest_m * t.crest_m + t.crest_m * t.root_m + t.root_m * t.root_m) / 3.0;
  return t.crest_m * t.crest_m / 8 + t.root_m * t.root_m / 4 + flank * 5 / 8;
}

TrueThread external_of(const ThreadShape& s) {
  const double crest = 0.5 * s.diameter_m - s.clearance_m;
  return {crest, crest - thread_depth_m(s.pitch_m), s.pitch_m};
}
TrueThread internal_of(const ThreadShape& s) {
  const double crest = 0.5 * s.diameter_m + s.clearance_m;
  return {crest, crest - thread_depth_m(s.pitch_m), s.pitch_m};
}

/// Points of a face, corners included.
std::vector<Point3> samples(const RawMesh& mesh, const RawFace& face) {
  constexpr int kSteps = 6;
  std::vector<Point3> points;
  for (std::size_t k = 1; k + 1 < face.vertices.size(); ++k) {
    const Point3 &a = mesh.vertices[face.vertices[0]], &b = mesh.vertices[face.vertices[k]],
                 &c = mesh.vertices[face.vertices[k + 1]];
    for (int i = 0; i <= kSteps; ++i) {
      for (int j = 0; i + j <= kSteps; ++j) {
        const double u = static_cast<double>(i) / kSteps, v = static_cast<double>(j) / kSteps;
        Point3 p;
        for (std::size_t x = 0; x < 3; ++x) p[x] = (1 - u - v) * a[x] + u * b[x] + v * c[x];
        points.push_back(p);
      }
    }
  }
  return points;
}

/// The faces of the thread itself: not in a plane across the axis, not on the outer wall.
std::vector<const RawFace*> thread_faces(const RawMesh& mesh, double largest_radius_m) {
  std::vector<const RawFace*> faces;
  for (const RawFace& face : mesh.faces) {
    double low = HUGE_VAL, high = -HUGE_VAL, radius = 0.0;
    for (const std::uint32_t v : face.vertices) {
      const Point3& p = mesh.vertices[v];
      low = std::min(low, p[2]);
      high = std::max(high, p[2]);
      radius = std::max(radius, std::hypot(p[0], p[1]));
    }
    if (high > low && radius < largest_radius_m) faces.push_back(&face);
  }
  return faces;
}

}  // namespace

TEST_SUITE("tools.shapes") {
  TEST_CASE("threads are closed: rods are balls, tubes and nuts are rings") {
    for (const std::uint32_t segments : {8U, 12U, 31U, 32U, 60U}) {
      for (const double turns : {1.0, 1.3, 4.0, 7.77}) {
        CAPTURE(segments);
        CAPTURE(turns);
        for (const bool internal : {false, true}) {
          const ThreadShape thread{8e-3, 1.25e-3, turns, internal, 7e-3, 0.0, segments};
          const RawMesh mesh = shape_mesh(thread, "thread");
          CHECK(closed_defect(mesh, 1e-16) == "");
          CHECK(euler_characteristic(mesh) == (internal ? 0 : 2));
          CHECK(volume_m3(mesh) > 0.0);
        }
      }
    }
  }

  TEST_CASE("volume of a thread: that of the helicoid, from within, nearer with each segment") {
    for (const double turns : {3.0, 4.37}) {
      for (const bool internal : {false, true}) {
        double error_before = 0.0;
        for (const std::uint32_t segments : {24U, 48U, 96U}) {
          const ThreadShape thread{8e-3, 1.25e-3, turns, internal, 7e-3, 0.0, segments};
          const double area =
              std::numbers::pi * mean_square(internal ? internal_of(thread) : external_of(thread));
          const double height = turns * 1.25e-3;
          // The outer wall of the tube is a polygon, not a circle.
          const double wall = 0.5 * segments * 49e-6 * std::sin(2.0 * std::numbers::pi / segments);
          const double exact = height * (internal ? wall - area : area);
          const double error = exact - volume_m3(shape_mesh(thread, "thread"));
          CAPTURE(segments);
          CHECK(error > 0.0);  // facets in the material
          CHECK(error < 0.05 * exact);
          // Second order, but for what the diagonals of the flanks add.
          if (error_before > 0.0) {
            CHECK(error_before / error > 3.0);
            CHECK(error_before / error < 4.2);
          }
          error_before = error;
        }
      }
    }
  }

  TEST_CASE("pitch and depth of the profile of ISO 68-1") {
    const double p = 1.25e-3;
    CHECK(thread_depth_m(p) == doctest::Approx(0.54127 * p).epsilon(1e-5));
    const ThreadShape thread{8e-3, p, 5.0, false, 0.0, 20e-6, 32};
    const RawMesh mesh = shape_mesh(thread, "thread");
    // Corners on the half-plane of +x: a crest at z = 0 and after each pitch.
    std::set<double> crest, root;
    for (const Point3& v : mesh.vertices) {
      if (v[1] != 0.0 || v[0] <= 0.0 || std::abs(v[2]) >= 2.5 * p) continue;
      (v[0] > 3.6e-3 ? crest : root).insert(v[2]);
      CHECK(v[0] == doctest::Approx(v[0] > 3.6e-3 ? 4e-3 - 20e-6 : 4e-3 - 20e-6 - thread_depth_m(p))
                        .epsilon(1e-13));
    }
    REQUIRE(crest.size() == 10);
    REQUIRE(root.size() == 10);
    std::size_t k = 0;
    for (const double z : crest) {
      const double middle = p * (static_cast<double>(k / 2) - 2.0);
      CHECK(z == doctest::Approx(middle + (k % 2 == 0 ? -p / 16 : p / 16)).epsilon(1e-12));
      ++k;
    }
    k = 0;
    for (const double z : root) {
      const double middle = p * (static_cast<double>(k / 2) - 2.0 + (k % 2 == 0 ? -0.5 : 0.5));
      CHECK(z == doctest::Approx(middle + (k % 2 == 0 ? p / 8 : -p / 8)).epsilon(1e-12));
      ++k;
    }
    // Basic dimensions of M8: minor diameter 6.647 mm.
    CHECK(8e-3 - 2 * thread_depth_m(p) == doctest::Approx(6.647e-3).epsilon(1e-4));
  }

  TEST_CASE(
      "no facet of a thread leaves the material of the true thread, nor is farther than told") {
    for (const std::uint32_t segments : {8U, 24U, 33U, 96U, 480U}) {
      for (const bool internal : {false, true}) {
        CAPTURE(segments);
        CAPTURE(internal);
        const ThreadShape thread{8e-3, 1.25e-3, 2.3, internal, 9e-3, 15e-6, segments};
        const TrueThread exact = internal ? internal_of(thread) : external_of(thread);
        const RawMesh mesh = shape_mesh(thread, "thread");
        ThreadShape bare = thread;
        bare.outer_radius_m = 0.0;
        const double told = chord_error_m(bare);
        double out = 0.0, farthest = 0.0;
        std::size_t count = 0;
        for (const RawFace* face : thread_faces(mesh, 8e-3)) {
          for (const Point3& p : samples(mesh, *face)) {
            const double inward = (exact.radius(p) - std::hypot(p[0], p[1])) * (internal ? -1 : 1);
            out = std::max(out, -inward);
            farthest = std::max(farthest, exact.on_flank(p) ? 0.5 * inward : inward);
            ++count;
          }
        }
        CHECK(count > 1000);
        CHECK(out < 1e-4 * told + 1e-15);
        CHECK(farthest <= told * (1 + 1e-9));
        CHECK(farthest > 0.5 * told);
      }
    }
  }

  TEST_CASE("half a turn about the x axis maps a thread onto itself, bit for bit") {
    const ThreadShape rod{10e-3, 1.5e-3, 3.7, false, 0.0, 0.0, 32};
    CHECK(is_symmetric(shape_mesh(rod, "thread"), {1, -1, -1}));
    CHECK_FALSE(is_symmetric(shape_mesh(rod, "thread"), {1, 1, -1}));
    CHECK(is_symmetric(shape_mesh(ThreadShape{10e-3, 1.5e-3, 3.7, true, 9e-3, 0.0, 24}, "thread"),
                       {1, -1, -1}));
  }

  TEST_CASE("nuts and bolts of every size: closed, dimensions of the tables, cleaned as they are") {
    for (const FastenerSize& size : fastener_sizes()) {
      CAPTURE(size.name);
      const NutShape nut{size.diameter_m,   size.pitch_m, size.width_across_flats_m,
                         size.nut_height_m, 0.0,          32};
      const BoltShape bolt{size.diameter_m,
                           size.pitch_m,
                           size.width_across_flats_m,
                           size.head_height_m,
                           3 * size.diameter_m,
                           10e-6,
                           32};
      for (const Shape& shape : {Shape{nut}, Shape{bolt}}) {
        const bool is_nut = shape_word(shape) == "nut";
        const RawMesh mesh = shape_mesh(shape, "part");
        CHECK(closed_defect(mesh, 1e-16) == "");
        CHECK(euler_characteristic(mesh) == (is_nut ? 0 : 2));
        Point3 low{1, 1, 1}, high{-1, -1, -1};
        for (const Point3& p : mesh.vertices) {
          for (std::size_t k = 0; k < 3; ++k) {
            low[k] = std::min(low[k], p[k]);
            high[k] = std::max(high[k], p[k]);
          }
        }
        CHECK(high[1] - low[1] == doctest::Approx(size.width_across_flats_m));
        CHECK(high[0] - low[0] ==
              doctest::Approx(size.width_across_flats_m / std::cos(std::numbers::pi / 6)));
        CHECK(high[2] == doctest::Approx(is_nut ? 0.5 * size.nut_height_m : size.head_height_m));
        CHECK(low[2] == doctest::Approx(is_nut ? -0.5 * size.nut_height_m : -3 * size.diameter_m));
        // Hexagon less or with a thread, as of the helicoid.
        const double hexagon =
            std::sqrt(3.0) / 2 * size.width_across_flats_m * size.width_across_flats_m;
        const double nominal = 0.5 * size.diameter_m - (is_nut ? 0.0 : 10e-6);
        const double thread =
            std::numbers::pi *
            mean_square({nominal, nominal - thread_depth_m(size.pitch_m), size.pitch_m});
        const double exact = is_nut ? size.nut_height_m * (hexagon - thread)
                                    : size.head_height_m * hexagon + 3 * size.diameter_m * thread;
        CHECK(volume_m3(mesh) == doctest::Approx(exact).epsilon(0.01));
        CHECK(volume_m3(mesh) < exact);
        const Surface surface = clean(mesh);
        CHECK(violation(surface) == "");
        CHECK(volume(surface) == doctest::Approx(volume_m3(mesh)).epsilon(1e-6));
        CHECK(surface.vertices.size() == mesh.vertices.size());
      }
    }
  }
}
