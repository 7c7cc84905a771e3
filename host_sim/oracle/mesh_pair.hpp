// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A moving set of triangles against a fixed one, in long double: crossings with their depth, the
/// distance, and what happens on the way from one pose to the next. Any triangles: open, torn,
/// through one another. Candidates come from a tree of boxes; every verdict on a pair is that of
/// triangle_pair.hpp.

#include <array>
#include <cstdint>
#include <vector>

#include "host_sim/oracle/placed_pair.hpp"
#include "host_sim/oracle/triangle_pair.hpp"

namespace haptic::sim {

/// The pose `share` of the way on: the origin goes straight, the turn is at constant speed about
/// one axis.
struct StraightWay {
  OraclePose from;
  WideVec move_m, turn_rad;
  [[nodiscard]] OraclePose at(Wide share) const;
};

/// Intersection of two meshes at a pose.
struct MeshCrossing {
  std::uint64_t meeting = 0;  ///< pairs of triangles that share a point, exactly
  Wide depth_m = 0;           ///< of the deepest pair: shortest translation that takes it apart
  std::uint32_t moving = 0, fixed = 0;  ///< that pair, by its numbers in the lists given
};

/// The way between two poses, at its worst pair.
struct MeshPassage {
  Wide gap_m = 0;                       ///< smallest gap of a pair, where negative; else 0
  std::uint64_t unproven = 0;           ///< parts of ways cut down to the resolution
  std::uint32_t moving = 0, fixed = 0;  ///< the pair of the smallest gap
};

class MeshPair {
 public:
  /// Triangles without area are left out. Poses map the first list to the frame of the second.
  MeshPair(const std::vector<Triangle>& moving, const std::vector<Triangle>& fixed);

  [[nodiscard]] MeshCrossing crossing(const OraclePose& pose) const;
  /// Smallest distance; `within_m` where it is not below.
  [[nodiscard]] Wide distance_m(const OraclePose& pose, Wide within_m) const;
  /// Every pair that comes near on the way is cut in halves in time until each part is proven to
  /// stay above `-allowed_m` by one moving plane or by the speed of its points, or is shorter than
  /// `resolution_m`; a pair stops at its first sample that is deeper.
  [[nodiscard]] MeshPassage passage(const StraightWay& way, Wide allowed_m,
                                    Wide resolution_m) const;

  [[nodiscard]] Wide radius_m() const {
    return radius_m_;
  }  ///< of the moving one, about its origin
  [[nodiscard]] Wide extent_m() const { return extent_m_; }  ///< of the fixed one, about its origin
  [[nodiscard]] std::size_t left_out() const { return left_out_; }

 private:
  struct Box {
    std::array<double, 3> low{HUGE_VAL, HUGE_VAL, HUGE_VAL}, high{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    void include(const Triangle& t, Wide margin_m);
    void include(const Box& other);
    [[nodiscard]] bool meets(const Box& other) const;
    [[nodiscard]] double distance(const Box& other) const;  ///< never above that of the contents
  };
  struct Node {
    Box box;
    std::uint32_t begin = 0, end = 0;  ///< in order_
    std::uint32_t child = 0;           ///< the first of two, 0: a leaf
  };
  struct Sample {
    Wide at = 0;
    OraclePose pose;
    Triangle a;
    TriangleGap gap;
  };
  void build(std::uint32_t node);
  template <typename Visit>
  void near(const Box& box, const Visit& visit) const;
  [[nodiscard]] Sample sampled(const StraightWay& way, std::uint32_t moving, const Triangle& b,
                               Wide at, int first) const;
  [[nodiscard]] bool proven(const Sample& from, const Sample& to, const Triangle& b,
                            const TriangleGap& by, Wide bend_m, Wide allowed_m) const;
  void pass(const StraightWay& way, std::uint32_t moving, std::uint32_t fixed, Wide allowed_m,
            Wide resolution_m, MeshPassage& passage) const;

  std::vector<Triangle> moving_, fixed_;
  std::vector<std::uint32_t> moving_number_, fixed_number_;  ///< in the lists given
  std::vector<Wide> lever_m_;                                ///< of each moving triangle
  std::vector<Box> fixed_box_;
  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;
  Wide radius_m_ = 0, extent_m_ = 0;
  std::size_t left_out_ = 0;
};

}  // namespace haptic::sim
