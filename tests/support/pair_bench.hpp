// SPDX-License-Identifier: Apache-2.0
#pragma once
/// One pair of convex bodies at any pose, searched directly, and by a brute force over all its
/// basic contacts.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "host_sim/lab/peers/pair_tables.hpp"
#include "rt_core/tracking/near_set.hpp"
#include "rt_core/tracking/pair_verdict.hpp"
#include "tests/support/shapes.hpp"

namespace haptic::test {

class PairBench {
 public:
  /// `epsilon_m` becomes the scene's.
  PairBench(const tools::Body& a, const tools::Body& b, double epsilon_m = 1e-4);
  /// Pair 0 of a scene, with its marks.
  explicit PairBench(const tools::SceneDescription& description);

  /// Pose at position x and quaternion (w, x, y, z) of A; the result holds until the next call.
  const PairPose& at(const Point& x, const std::array<double, 4>& q_wxyz);

  /// Search at the last pose of `at`; odometers advance by the motion since the last search.
  NearResult search(NodeScope scope = NodeScope::kReachable);
  /// Near set of the last search.
  [[nodiscard]] std::span<const NearNode> near() const { return tables_.near.view(); }
  /// Forgets all bounds.
  void reset();

  /// Largest value over all applicable nodes of the scope at the last pose; kNoDepth: none.
  [[nodiscard]] Real exhaustive_d_near(NodeScope scope = NodeScope::kReachable) const;
  /// Node numbers of the near set, live nodes alone, by its definition, ascending; nodes within
  /// `margin_m` of the boundary of the definition go to `doubtful`.
  [[nodiscard]] std::vector<std::uint32_t> exhaustive_near(
      Real d_near_m, Real margin_m, std::vector<std::uint32_t>& doubtful) const;

  [[nodiscard]] const PairView& pair() const { return pair_; }
  [[nodiscard]] const PairPose& pose() const { return pose_; }
  [[nodiscard]] const FeatureBounds& bounds() const { return tables_.bounds; }

 private:
  LoadedScene scene_;
  PairView pair_;
  sim::PairTables tables_;
  Real epsilon_m_;
  PairPose pose_;
  Odometer odometer_;
  Vec3 last_y_ = Vec3::Zero();
  Mat3 last_r_ = Mat3::Identity();
  bool moved_ = false;
};

}  // namespace haptic::test
