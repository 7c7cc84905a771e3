// SPDX-License-Identifier: Apache-2.0
#pragma once
/// D_near tick by tick against the exhaustive search, on coherent 1 kHz paths with jumps.

#include <cstdint>
#include <string>
#include <vector>

#include "host_sim/lab/verification/verified_pair.hpp"
#include "host_sim/report/failure_log.hpp"
#include "host_sim/report/shard_run.hpp"

namespace haptic::sim {

/// Separations up to here must be exact; beyond, D_near is a lower bound of the distance [m].
inline constexpr Wide kExactBand_m = 5e-3L;

struct DepthTotals {
  std::uint64_t ticks = 0;
  std::uint64_t inside = 0, near = 0;  ///< by the oracle: D_near <= 0, and up to kExactBand_m
  std::uint64_t jumps = 0;
  std::uint64_t wrong = 0;         ///< inside or near: off by more than the tolerance
  std::uint64_t wrong_bounds = 0;  ///< beyond: above D_near, or not above 0
  std::uint64_t said_inexact = 0;  ///< inside or near, but flagged as a lower bound
  std::uint64_t ranges = 0;        ///< near, edges almost parallel: D_near itself is a range
  Wide largest_inside_m = 0;       ///< error
  Wide largest_near_m = 0;
  FailureLog failures;

  [[nodiscard]] bool passed() const { return wrong + wrong_bounds == 0; }
  void add(const DepthTotals& other);
};

struct DepthRow {
  std::string pair;
  double size_m = 0;
  DepthTotals totals;
};

struct DepthCampaign {
  std::uint64_t ticks = 200000;  ///< over all pairs, by near_share
  std::uint64_t seed = 1;
};

/// Tolerance of D_near for a pair [m]: 1e-12 of its size in double.
[[nodiscard]] Wide depth_tolerance_m(const VerifiedPair& pair);

/// Compares one tick.
void check_depth(VerifiedPair& pair, const Pose& pose_wa, const PairTruth& truth,
                 DepthTotals& totals);

/// Paths at up to 1 m/s and 10 rad/s, steered by the exhaustive search, a jump every few hundred
/// ticks. One row per pair. Deterministic for equal campaigns.
[[nodiscard]] std::vector<DepthRow> run_depths(const DepthCampaign& campaign,
                                               const std::vector<VerifiedBodies>& pairs,
                                               const RunOptions& options);

/// As a campaign of one pair, on a pair that exists already.
[[nodiscard]] DepthTotals run_depths_on(VerifiedPair& pair, const VerifiedBodies& bodies,
                                        std::uint64_t ticks, std::uint64_t seed);

}  // namespace haptic::sim
