// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The project's own methods as peers: the real-time core on a scene of one pair, and the paper's
/// steps as printed.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "host_sim/lab/peers/peer_query.hpp"
#include "host_sim/shapes/shapes.hpp"

namespace haptic::sim {

/// Scalar of the core in this build, as tables name it.
inline constexpr const char* kRealName = sizeof(Real) == sizeof(double) ? "double" : "float";

/// The whole tick of HapticCore under law paper, on A over one static body made of `pieces`:
/// verdict, D_near, near set, contact region, wrench. For several pieces the answer is that of the
/// nearest, and the points are those of all.
/// @throws tools::InputError when the scene is refused.
[[nodiscard]] std::unique_ptr<PeerQuery> make_core_peer(const Solid& a,
                                                        std::span<const Solid> pieces);

/// LiteralTracker with delta from the translation, or with the lever of the turn added.
/// @throws tools::InputError when the scene is refused.
[[nodiscard]] std::unique_ptr<PeerQuery> make_literal_peer(const Solid& a, const Solid& b,
                                                           bool with_rotation);

}  // namespace haptic::sim
