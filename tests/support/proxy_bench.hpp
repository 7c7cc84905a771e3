// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A proxy over a scene without the rest of the core: goals in, ticks out, with the number of
/// passes and the lengths of a pass at will.

#include <cstdint>
#include <vector>

#include "rt_core/proxy/proxy_law.hpp"
#include "tests/support/shapes.hpp"

namespace haptic::test {

/// Scene description for law `proxy`: 1000 N/m, identity start, grip at the origin of A, friction
/// of all bodies.
tools::SceneDescription proxy_scene_of(const tools::Body& moving,
                                       const std::vector<tools::Body>& statics,
                                       double friction = 0);

/// The pose with x_0^A at `p` and the quaternion (w, x, y, z), which is normalised.
GripPose grip_pose(const Point& p, const std::array<double, 4>& q_wxyz = {1, 0, 0, 0});

/// Translational stiffness times the tolerance of "free" that the scene's proxy has [N].
double tolerance_n(const LoadedScene& scene);

class ProxyBench {
 public:
  explicit ProxyBench(const tools::SceneDescription& description,
                      std::uint32_t passes = kDefaultProxyPasses);
  ProxyBench(const ProxyBench&) = delete;
  ProxyBench& operator=(const ProxyBench&) = delete;

  ProxyTick tick(const GripPose& goal) { return proxy.tick(goal, scratch_); }
  ProxyTick tick(const Point& p, const std::array<double, 4>& q_wxyz = {1, 0, 0, 0}) {
    return tick(grip_pose(p, q_wxyz));
  }
  /// Signed distance of every pair at a pose by all faces and all pairs of edges: the smallest [m].
  /// Over all vertices, without supports.
  [[nodiscard]] Real distance_m(const GripPose& pose) const;

  LoadedScene scene;
  Proxy proxy;
  Proxy::Parameters parameters;

 private:
  std::vector<PairView> views_;
  std::vector<std::uint64_t> memory_;
  NearScratch scratch_;
};

}  // namespace haptic::test
