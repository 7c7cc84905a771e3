// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Near sets against their definition, evaluated for every node of the graph.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "host_sim/lab/verification/verified_pair.hpp"
#include "host_sim/report/failure_log.hpp"
#include "host_sim/report/shard_run.hpp"
#include "rt_core/tracking/near_set.hpp"

namespace haptic::sim {

struct NearTotals {
  std::uint64_t poses = 0;    ///< at which the near set was compared
  std::uint64_t beyond = 0;   ///< poses beyond the exact band: no near set is due
  std::uint64_t ranges = 0;   ///< poses at which D_near itself is a range: not compared
  std::uint64_t members = 0;  ///< by the definition
  std::uint64_t missing = 0, extra = 0;
  std::uint64_t subset_missing = 0;  ///< |f - D| + (f - s(n)) < epsilon, but not in the set
  std::uint64_t ambiguous = 0;       ///< nodes within rounding of a bound: either is right
  std::uint64_t cut = 0;             ///< near sets that had no room
  std::uint64_t several = 0;         ///< poses with more than one member
  std::uint64_t largest_set = 0;
  FailureLog failures;

  [[nodiscard]] bool passed() const { return missing + extra + subset_missing + cut == 0; }
  void add(const NearTotals& other);
};

struct NearRow {
  std::string pair;
  double epsilon_m = 0;
  NearTotals totals;
};

struct NearCampaign {
  std::uint64_t poses = 100000;  ///< over all pairs, by near_share
  std::uint64_t seed = 1;
};

/// Compares a near set found at `pose_wa` with the definition:
/// a node is near when |f - D| + max(v, 0) < epsilon, D the largest value over all applicable
/// nodes. Types A and B: v is the largest height of a vertex joined by an edge to the node's, and
/// f - s(n) < kMaxRise epsilon. Type C: v is the larger of the heights that the two pieces rise
/// over the plane of the sign with the smaller violation; edges with a sine below the square root
/// of the unit roundoff are left out. @return false beyond the exact band, or when D itself is
/// a range there; nothing is counted then but that.
bool check_near_set(VerifiedPair& pair, const Pose& pose_wa, std::span<const NearNode> near,
                    NearTotals& totals);

/// Poses in contact and near it: generic ones, faces on faces with tilts of 1e-9 to 1e-3 rad, edges
/// on faces, corners, aligned; each followed by a few ticks of small motion; epsilon 0.1, 0.2 and
/// 0.5 mm. One row per pair and epsilon. Deterministic for equal campaigns.
[[nodiscard]] std::vector<NearRow> run_near_sets(const NearCampaign& campaign,
                                                 const std::vector<VerifiedBodies>& pairs,
                                                 const RunOptions& options);

/// As a campaign of one pair, on a pair that exists already.
[[nodiscard]] NearTotals run_near_sets_on(VerifiedPair& pair, const VerifiedBodies& bodies,
                                          std::uint64_t poses, std::uint64_t seed);

}  // namespace haptic::sim
