// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Virtual coupling: a simulated part that a spring and a damper draw to the pose of the hand,
/// while contacts of the method's own keep it out of what stands. The hand feels the spring. Plain
/// types only, so that an adapter of a foreign library sees nothing of ours. SI units.

#include <memory>

#include "host_sim/lab/peers/penalty_peer.hpp"

namespace haptic::sim {

struct CouplingGains {
  double k_t_n_per_m = 0, k_r_nm_per_rad = 0;
  double tick_s = 1e-3;
};

class CoupledPeer {
 public:
  CoupledPeer() = default;
  CoupledPeer(const CoupledPeer&) = delete;
  CoupledPeer& operator=(const CoupledPeer&) = delete;
  virtual ~CoupledPeer() = default;

  /// The part is at rest at the pose of the grip point, and so is the hand.
  virtual void begin(const PeerPose& grip) = 0;
  /// One tick, to whose end the hand has come to `goal`. Timed. @throws std::runtime_error where
  /// the simulation gives up.
  virtual void tick(const PeerPose& goal) = 0;
  /// Where the spring that the hand feels in this tick holds the part, in this form alone; `r_wa`
  /// is not given.
  [[nodiscard]] virtual PeerPose place() const = 0;
};

/// How stiff in rotation a part in free air may be coupled at the gains' tick, damped critically,
/// the damping implicit. By bisection, to 1 %.
struct TurnLimit {
  double own_inertia_kgm2 = 0;     ///< least principal moment of the uniform solid
  double most_k_r_nm_per_rad = 0;  ///< with that inertia
  double least_inertia_kgm2 = 0;   ///< the least that every axis must have at the gains' k_r
  double used_inertia_kgm2 = 0;    ///< least moment of the part that is simulated
};

/// The part as a body of MuJoCo of `mass_kg`: its inertia that of the uniform solid, each principal
/// moment raised to twice the least that is stable. Boxes as boxes, other pieces as meshes with
/// several contacts a pair (multiccd); Newton solver, elliptic cones, impratio 10, implicit
/// integrator, one step a tick, solref 4 ms.
/// @throws std::runtime_error with MuJoCo's message where it refuses the model.
[[nodiscard]] std::unique_ptr<CoupledPeer> make_mujoco_coupled(const PenaltyBodies& bodies,
                                                               const CouplingGains& gains,
                                                               double mass_kg, double friction);
[[nodiscard]] TurnLimit mujoco_turn_limit(const PenaltyBodies& bodies, const CouplingGains& gains,
                                          double mass_kg);

}  // namespace haptic::sim
