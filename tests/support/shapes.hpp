// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Convex bodies and scenes for tests, made without meshes.

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "rt_core/haptic_core.hpp"
#include "tests/support/random.hpp"
#include "tools/graph_compiler/graph/scene_writer.hpp"

namespace haptic::test {

using Point = std::array<double, 3>;

/// A body of one convex piece; faces as vertex loops, counter-clockwise from outside; planes are
/// computed.
tools::Body convex_body(const std::vector<Point>& vertices,
                        const std::vector<std::vector<std::uint32_t>>& faces);

/// Box with corners lo and hi; vertex k has hi in axis i where bit i of k is set.
tools::Body box(const Point& lo, const Point& hi);

/// Tetrahedron of four points (any orientation).
tools::Body tetrahedron(const Point& a, const Point& b, const Point& c, const Point& d);

/// Regular prism about z: n-gon of circumradius r, from -h/2 to h/2.
tools::Body prism(int n, double radius, double height);

/// A surface of one facet, open all round: a flat convex polygon with its corners in order.
tools::Body facet(const std::vector<Point>& corners);

/// Convex hull of `count` points on an ellipsoid with the given semi-axes, seeded; triangles only.
/// O(count^4): for tens of points.
tools::Body random_hull(std::uint64_t seed, int count, const Point& axes);

/// Joins bodies into one of several pieces; planes that are bitwise equal up to sign are shared.
tools::Body join(const std::vector<tools::Body>& bodies);

/// Scene description with law `paper`, k_F 1000 N/m, epsilon 1e-4 m, exact at any distance,
/// identity start, grip at the origin of A.
tools::SceneDescription scene_of(const tools::Body& moving,
                                 const std::vector<tools::Body>& statics);

/// Blob in aligned memory, opened, with a core in its own aligned memory.
class LoadedScene {
 public:
  explicit LoadedScene(const tools::SceneDescription& description);
  explicit LoadedScene(const std::vector<std::byte>& blob);
  LoadedScene(const LoadedScene&) = delete;
  LoadedScene& operator=(const LoadedScene&) = delete;

  SceneView view;
  HapticCore* core = nullptr;

  /// Steps the core at position p and quaternion (w, x, y, z), and asks for the contact there.
  StepResult step(const Point& p, const std::array<double, 4>& q_wxyz = {1, 0, 0, 0});

 private:
  void open();
  struct alignas(64) Line {
    std::array<std::byte, 64> bytes;
  };
  std::vector<Line> blob_, memory_;
  std::size_t blob_bytes_ = 0;
};

}  // namespace haptic::test
