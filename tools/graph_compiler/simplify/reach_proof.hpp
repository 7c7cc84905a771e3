// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Proof that every point of a triangle lies within a distance of a set of triangles.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "tools/graph_compiler/simplify/face_triangles.hpp"

namespace haptic::tools {

/// Distance of a point from a point of the triangle, the nearest one to within rounding: never
/// below the distance from the triangle, however thin it is.
double reach_of(const Point3& p, const FaceTriangle& t);

/// Branch and bound. The distance from one triangle is a convex function of the point, so a part of
/// a triangle whose three corners lie within the distance of one target lies within it as a whole.
/// Other parts are cut, along the border of the target that is nearest or in half;
/// large parts come first, so that a corner too far is found early.
class ReachProof {
 public:
  /// True: proved. False: some corner of a part is farther than `within_m` from all targets, or no
  /// proof was found within the limit of parts. Cost: O(targets) for each part at worst; targets
  /// out of reach of a part are not looked at below it.
  /// @param effort  multiplies the limit of parts.
  bool holds(const FaceTriangle& t, std::span<const FaceTriangle> targets, double within_m,
             std::size_t effort = 1);

  /// After a proof: for each target whether the proof needs it, and the largest distance that it
  /// has shown.
  [[nodiscard]] const std::vector<std::uint8_t>& used() const { return used_; }
  [[nodiscard]] double bound_m() const { return bound_m_; }

 private:
  /// A part of the triangle, and the targets that its parent could reach.
  struct Part {
    FaceTriangle t;
    std::size_t begin = 0, end = 0;  ///< of near_
    int depth = 0;
  };
  bool look_at(std::size_t part);

  std::span<const FaceTriangle> targets_;
  double within_m_ = 0.0, bound_m_ = 0.0;
  std::vector<vec::Box> boxes_;      // of the targets
  std::vector<Part> parts_;          // in the order in which they are looked at
  std::vector<std::uint32_t> near_;  // targets
  std::vector<std::uint8_t> used_;
};

}  // namespace haptic::tools
