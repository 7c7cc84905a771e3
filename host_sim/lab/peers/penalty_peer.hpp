// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Penalty rendering with a collision library: at the pose that the device asks for, each pair of
/// convex pieces that the library finds in collision pushes with the stiffness times its depth,
/// along its normal, at its contact point. Plain types only, as in `peer_query.hpp`. SI units.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "host_sim/lab/peers/peer_query.hpp"

namespace haptic::sim {

/// Convex pieces of both bodies. Moving: A's axes about the grip point; fixed: W [m].
struct PenaltyBodies {
  std::vector<PeerSolid> moving, fixed;
};

/// On the hand, W axes, torque about the grip point.
struct PenaltyWrench {
  PeerVector force_n{}, torque_nm{};                  ///< of all contacts
  PeerVector deepest_force_n{}, deepest_torque_nm{};  ///< of the deepest contact alone
  double deepest_m = 0;
  std::uint32_t pairs = 0;     ///< in collision
  std::uint32_t failures = 0;  ///< pairs that the library gave up on; they push with nothing

  /// Adds the spring of one contact: `depth_m` > 0 inside, the normal towards which A has to leave.
  void push(double stiffness_n_per_m, double depth_m, const PeerVector& normal_w,
            const PeerVector& point_w, const PeerVector& grip_w);
};

class PenaltyPeer {
 public:
  PenaltyPeer() = default;
  PenaltyPeer(const PenaltyPeer&) = delete;
  PenaltyPeer& operator=(const PenaltyPeer&) = delete;
  virtual ~PenaltyPeer() = default;

  /// Takes the pose of the grip point over into the method's own types. Not timed.
  virtual void prepare(const PeerPose& pose) = 0;
  /// One tick: boxes of the moving pieces, broad phase, narrow phase, sum. Timed.
  [[nodiscard]] virtual PenaltyWrench render() = 0;
};

inline void PenaltyWrench::push(double stiffness_n_per_m, double depth_m,
                                const PeerVector& normal_w, const PeerVector& point_w,
                                const PeerVector& grip_w) {
  PeerVector f{}, r{};
  for (std::size_t i = 0; i < 3; ++i) {
    f[i] = stiffness_n_per_m * depth_m * normal_w[i];
    r[i] = point_w[i] - grip_w[i];
  }
  const PeerVector t{r[1] * f[2] - r[2] * f[1], r[2] * f[0] - r[0] * f[2],
                     r[0] * f[1] - r[1] * f[0]};
  for (std::size_t i = 0; i < 3; ++i) {
    force_n[i] += f[i];
    torque_nm[i] += t[i];
  }
  if (depth_m <= deepest_m) return;
  deepest_m = depth_m;
  deepest_force_n = f;
  deepest_torque_nm = t;
}

}  // namespace haptic::sim
