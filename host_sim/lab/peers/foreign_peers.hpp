// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Adapters of the collision libraries that the build found. Each file knows one library and
/// nothing of the project but `peer_query.hpp`; which of them exist is known to the build alone
/// (HAPTIC_PEER_* definitions) and to `peer_catalog`.

#include <memory>

#include "host_sim/lab/peers/peer_query.hpp"

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

}  // namespace haptic::sim
