// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The pairs of a scene in plain double, without supports, certificates or tracking: what the
/// literal method of the paper and the exhaustive search that the core is timed against work on.

#include <array>
#include <cstdint>
#include <vector>

#include "rt_core/base/pose.hpp"
#include "rt_core/scene/graph_rule.hpp"
#include "rt_core/scene/scene_view.hpp"

namespace haptic::tools {

using Point = std::array<double, 3>;

[[nodiscard]] inline Point operator+(const Point& a, const Point& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
[[nodiscard]] inline Point operator-(const Point& a, const Point& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
[[nodiscard]] inline Point scaled(double s, const Point& a) {
  return {s * a[0], s * a[1], s * a[2]};
}
[[nodiscard]] inline double dot(const Point& a, const Point& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
[[nodiscard]] inline Point cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// Moving body of one tick, in W axes relative to the grip point.
struct PlacedMoving {
  Point grip_w{};               ///< grip point in W [m]
  std::array<Point, 3> r_wa{};  ///< rows of the rotation
};

[[nodiscard]] PlacedMoving place_moving(const SceneView& view, const Pose& pose_wa);

/// One pair with A rotated into W axes; all points relative to B's reference.
class FlatPair {
 public:
  FlatPair(const SceneView& view, PairIndex pair);

  /// Moves A. Cost: O(vertices + faces + edges of A).
  void place(const PlacedMoving& moving);

  struct Value {
    double depth_m = 0;      ///< f
    double violation_m = 0;  ///< <= 0: applicable
  };
  /// Plane value and applicability of a node (rt_core/METHOD.md section 2). Edge pairs whose sine
  /// is below kParallelSine are never applicable. Cost: O(degree of the vertex) for types A and B,
  /// O(1) for type C.
  [[nodiscard]] Value evaluate(std::uint32_t node) const;

  /// Largest plane value over all nodes applicable within `tolerance_m`; -infinity when there is
  /// none. Every node is evaluated. With strict signs and no supports a wrong value is possible at
  /// aligned bodies: this is the plain search.
  [[nodiscard]] double exhaustive_d_near_m(double tolerance_m) const;

  /// Outward unit normal of the node's C-face and its application point on B, relative to B's
  /// reference.
  void contact(std::uint32_t node, Point& normal, Point& application_point) const;

  [[nodiscard]] std::uint32_t node_count() const { return view_.record.node_count; }
  [[nodiscard]] const PairView& view() const { return view_; }
  /// Grip point relative to B's reference [m], of the last `place`.
  [[nodiscard]] const Point& grip_m() const { return grip_; }
  /// Largest |x - b + R a| over the vertices [m]: lever of a rotation.
  [[nodiscard]] double largest_lever_m() const;

  static constexpr double kParallelSine =
      1.5e-8;  ///< rt_core/METHOD.md section 11: square root of the unit roundoff

 private:
  [[nodiscard]] Value evaluate_c(std::uint32_t e, std::uint32_t g, Point& normal) const;

  PairView view_;
  Point reference_b_{};
  std::vector<Point> va_local_, na_local_, va_, na_, ua_;  ///< ua_: edge vectors of A, not unit
  std::vector<Point> vb_, nb_, ub_;
  Point grip_{};
};

}  // namespace haptic::tools
