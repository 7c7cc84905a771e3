// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Several moving bodies under their law: goals in, ticks out.

#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "rt_core/bodies/body_law.hpp"
#include "tests/support/proxy_bench.hpp"

namespace haptic::test {

/// A body of a bench: grip point at the origin of its mesh frame.
struct BenchBody {
  tools::Body body;
  GripPose start;  ///< free
  double k_n_per_m = 1000;
  bool is_held_back = true;
  double push_n = 0;  ///< the most that its spring pulls; 0: no limit
};

class BodyBench {
 public:
  /// `standing`: in W; without one there is no pair with it.
  BodyBench(const std::vector<BenchBody>& bodies, const std::vector<tools::Body>& standing,
            double friction = 0, std::uint32_t passes = kDefaultProxyPasses);
  BodyBench(const BodyBench&) = delete;
  BodyBench& operator=(const BodyBench&) = delete;

  BodiesTick tick(const std::vector<GripPose>& goals) { return law.tick(goals); }
  /// Smallest signed distance of any pair of bodies at these poses, by all faces and pairs of
  /// edges: exhaustive [m].
  [[nodiscard]] double distance_m(const std::vector<GripPose>& poses) const {
    return way_distance_m(poses, poses, 1);
  }
  /// The same on the way from one to the other, each pair of bodies on its own: A straight, and
  /// turning evenly, as B sees it.
  [[nodiscard]] double way_distance_m(std::span<const GripPose> from, std::span<const GripPose> to,
                                      Real share) const;
  [[nodiscard]] std::vector<GripPose> poses() const;
  [[nodiscard]] const std::vector<MovingBody>& bodies() const { return moving_; }

  BodyLaw law;
  BodyLaw::Parameters parameters;

 private:
  struct alignas(64) Line {
    std::array<std::byte, 64> bytes;
  };
  std::deque<LoadedScene> scenes_;
  std::vector<BodyPairScene> pairs_;
  std::vector<MovingBody> moving_;
  std::vector<Line> memory_;
};

/// Pose of A's grip point as B's mesh frame sees it, both with their grip points at the origin.
GripPose as_seen_from(const GripPose& b, const GripPose& a);

}  // namespace haptic::test
