// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Adapters of the collision libraries that the build found. Each file knows one library and
/// nothing of the project but `peer_query.hpp` and `penalty_peer.hpp`; which of them exist is known
/// to the build alone (HAPTIC_PEER_* definitions) and to `peer_catalog`.

#include <memory>

#include "host_sim/lab/peers/peer_query.hpp"
#include "host_sim/lab/peers/penalty_peer.hpp"

namespace haptic::sim {

/// libccd, Minkowski portal refinement. `tolerance_m`: mpr_tolerance.
[[nodiscard]] std::unique_ptr<PeerQuery> make_ccd_mpr_peer(const PeerSolid& a, const PeerSolid& b,
                                                           double tolerance_m);
/// libccd, GJK and expanding polytope. `tolerance_m`: epa_tolerance.
[[nodiscard]] std::unique_ptr<PeerQuery> make_ccd_epa_peer(const PeerSolid& a, const PeerSolid& b,
                                                           double tolerance_m);
/// FCL with its libccd solver, `fcl::collide` with one contact. `tolerance_m`: gjk_tolerance.
[[nodiscard]] std::unique_ptr<PeerQuery> make_fcl_peer(const PeerSolid& a, const PeerSolid& b,
                                                       double tolerance_m);
/// Bullet in double, btGjkPairDetector with btGjkEpaPenetrationDepthSolver, margin 0, its cached
/// separating axis kept from query to query.
[[nodiscard]] std::unique_ptr<PeerQuery> make_bullet_peer(const PeerSolid& a, const PeerSolid& b);
/// ODE, dBoxBox. Both bodies must be boxes along their axes about their origin.
[[nodiscard]] std::unique_ptr<PeerQuery> make_ode_peer(const PeerSolid& a, const PeerSolid& b);

// Penalty rendering with each library, one contact a pair but for ODE.

/// libccd, Minkowski portal refinement, behind boxes along the axes: the library has no broad
/// phase.
[[nodiscard]] std::unique_ptr<PenaltyPeer> make_ccd_mpr_penalty(const PenaltyBodies& bodies,
                                                                double stiffness_n_per_m);
/// The same with GJK and expanding polytope.
[[nodiscard]] std::unique_ptr<PenaltyPeer> make_ccd_epa_penalty(const PenaltyBodies& bodies,
                                                                double stiffness_n_per_m);
/// FCL, dynamic trees of boxes for both bodies, default request with contacts.
[[nodiscard]] std::unique_ptr<PenaltyPeer> make_fcl_penalty(const PenaltyBodies& bodies,
                                                            double stiffness_n_per_m);
/// Bullet in double, btDbvt of the fixed pieces, GJK and EPA with margin 0 and the separating axis
/// of each pair kept from tick to tick.
[[nodiscard]] std::unique_ptr<PenaltyPeer> make_bullet_penalty(const PenaltyBodies& bodies,
                                                               double stiffness_n_per_m);
/// ODE, spaces by hash, dCollide of convex geometries, up to sixteen contacts a pair. They share
/// the stiffness of the pair, or a flat contact would be as many times as stiff.
[[nodiscard]] std::unique_ptr<PenaltyPeer> make_ode_penalty(const PenaltyBodies& bodies,
                                                            double stiffness_n_per_m);

}  // namespace haptic::sim
