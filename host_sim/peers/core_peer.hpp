// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The project's own methods as peers: the real-time core on a scene of one pair, and the paper's
/// steps as printed.

#include <memory>

#include "host_sim/peers/peer_query.hpp"
#include "host_sim/reproduction/shapes.hpp"

namespace haptic::sim {

/// The whole tick of HapticCore: verdict, D_near, near set, contact region, wrench.
/// @throws tools::InputError when the scene is refused.
[[nodiscard]] std::unique_ptr<PeerQuery> make_core_peer(const Solid& a, const Solid& b);

/// LiteralTracker with delta from the translation, or with the lever of the turn added.
/// @throws tools::InputError when the scene is refused.
[[nodiscard]] std::unique_ptr<PeerQuery> make_literal_peer(const Solid& a, const Solid& b,
                                                           bool with_rotation);

}  // namespace haptic::sim
