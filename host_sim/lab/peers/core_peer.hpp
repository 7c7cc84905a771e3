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

/// What in a scene affects the time or the result of its tick.
struct CoreSetting {
  double epsilon_m = 1e-4;  ///< width of the near set; the paper's
  double exact_band_m = 0.005;
  LawId law = LawId::kPaper;
  std::uint32_t max_pair_visits = kDefaultPairVisits;  ///< in one tick
};

/// Compiled scene of A over one static body made of `pieces`.
[[nodiscard]] std::vector<std::byte> core_scene(const Solid& a, std::span<const Solid> pieces,
                                                const CoreSetting& setting);

/// The whole tick of HapticCore: verdict, D_near, near set, contact region, wrench. For several
/// pieces the answer is that of the nearest, and the points are those of all.
/// @throws tools::InputError when the scene is refused.
[[nodiscard]] std::unique_ptr<PeerQuery> make_core_peer(const Solid& a,
                                                        std::span<const Solid> pieces,
                                                        const CoreSetting& setting = {});

/// LiteralTracker with delta from the translation, or with the lever of the turn added.
/// @throws tools::InputError when the scene is refused.
[[nodiscard]] std::unique_ptr<PeerQuery> make_literal_peer(const Solid& a, const Solid& b,
                                                           bool with_rotation);

}  // namespace haptic::sim
