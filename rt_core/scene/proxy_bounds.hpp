// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Passes, rounds, planes and rows of the proxy in one tick, and the work that they add up to.

#include <algorithm>
#include <cstdint>

#include "rt_core/scene/scene_parameters.hpp"

namespace haptic {

/// Passes of the proxy in one tick: the default, and the most that a scene may ask for.
inline constexpr std::uint32_t kDefaultProxyPasses = 3, kMaxProxyPasses = 32;
/// Rounds of one pass: tries to impose what is needed, and again within smaller steps.
inline constexpr std::uint32_t kProxyRounds = 8, kProxyRetryRounds = 6, kProxyRetries = 2;
/// Steps of one pass that are tried when no round has found one: displaced ones (twice), shorter
/// ones.
inline constexpr std::uint32_t kMaxCorrections = 3, kMaxBackOffs = 4;
/// Planes in one quadratic program; its rows without friction.
inline constexpr std::uint32_t kMaxImposedPlanes = 32;
/// Rows of one program: without friction, and the most of all; iterations after which it ends with
/// what it has.
inline constexpr std::uint32_t kMaxProxyRows = 96, kMaxFrictionRows = 192, kMaxQpIterations = 96;
/// Planes of a pair's valid set that are kept, nodes that a search for them looks at, and pairs
/// whose sets a pass has room for; further ones keep their certificate as the only plane.
inline constexpr std::uint32_t kMaxValidPlanes = 64, kMaxValidVisits = 512;
inline constexpr std::uint32_t kMaxValidSearches = 64;

/// Work of the proxy in one tick of `passes` passes over `pairs` pairs, at most.
struct ProxyBounds {
  std::uint64_t plane_gaps, valid_nodes, full_searches;
};
constexpr ProxyBounds proxy_bounds(std::uint64_t pairs, std::uint64_t passes) noexcept {
  constexpr std::uint64_t kRounds = kProxyRounds + kProxyRetries * kProxyRetryRounds;
  constexpr std::uint64_t kChecks = kRounds + 2 * (kMaxCorrections + 1) + kMaxBackOffs;
  const std::uint64_t valid = std::min<std::uint64_t>(pairs, kMaxValidSearches) * kMaxValidPlanes;
  const std::uint64_t check = pairs + valid;  // each pair's certificate, and the valid sets
  const std::uint64_t rows =
      (1 + kProxyRetries) * kMaxImposedPlanes + 2 * kRounds + 2 * kMaxCorrections * pairs;
  return {passes * (pairs + kChecks * check + rows),
          passes * std::min<std::uint64_t>(pairs, valid) * kMaxValidVisits, passes * 2 * pairs};
}

/// The proxy's quadratic programs in one tick, at most. A pass solves one per round, and twice one
/// per correction, whose rows are one for each pair. `friction`: of any body.
struct ProgramBounds {
  std::uint32_t rounds, rows, iterations, programs, steps;
};
constexpr ProgramBounds program_bounds(std::uint64_t pairs, std::uint32_t passes,
                                       bool friction) noexcept {
  if (passes == 0) return {};
  constexpr std::uint32_t kRounds = kProxyRounds + kProxyRetries * kProxyRetryRounds;
  const auto corrected =
      static_cast<std::uint32_t>(std::min<std::uint64_t>(pairs, kMaxFrictionRows));
  const std::uint32_t programs = passes * (kRounds + 2 * kMaxCorrections);
  return {kRounds, friction ? kMaxFrictionRows : std::max(kMaxProxyRows, corrected),
          kMaxQpIterations, programs, programs * kMaxQpIterations};
}

/// Passes that a tick of a scene makes: none but of law kProxy.
constexpr std::uint32_t proxy_passes(const SceneParameters& p) noexcept {
  return p.law == LawId::kProxy ? p.coupling.passes : 0;
}

}  // namespace haptic
