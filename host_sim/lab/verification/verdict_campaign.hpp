// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Verdicts over many poses: every certificate is checked again in long double from the vertices
/// alone, and a seeded subset of the poses is judged by the exhaustive search.

#include <cstdint>
#include <string>
#include <vector>

#include "host_sim/lab/verification/verified_pair.hpp"
#include "host_sim/report/failure_log.hpp"
#include "host_sim/report/shard_run.hpp"

namespace haptic::sim {

/// What the core remembers when a query comes.
enum class QueryMode { kPath, kFirstTick, kJump };
[[nodiscard]] const char* name_of(QueryMode mode);

/// Counts over a set of queries. A query is one tick of the core at one pose of one pair.
struct VerdictTotals {
  std::uint64_t queries = 0;
  std::uint64_t separated = 0, colliding = 0, touching = 0, undecided = 0;
  std::uint64_t far_answers = 0;      ///< separated ones answered by a held plane or by spheres
  std::uint64_t inexact = 0;          ///< D_near said to be a lower bound
  std::uint64_t refused = 0;          ///< status other than ok
  std::uint64_t bad_separations = 0;  ///< the direction leaves no gap
  std::uint64_t bad_bounds = 0;       ///< the bound is larger than the gap
  std::uint64_t bad_collisions = 0;   ///< x is not in the tetrahedron
  std::uint64_t judged = 0, wrong_verdicts = 0;
  std::uint64_t wrong_boundaries = 0;  ///< touching or undecided away from the boundary
  std::uint64_t by_slack = 0;          ///< collision certificates that hold by the slack alone
  Wide largest_excess_m = 0;           ///< distance of x from its tetrahedron, of accepted ones
  Wide largest_thickness_m = 0;
  FailureLog failures;

  [[nodiscard]] std::uint64_t bad_certificates() const {
    return bad_separations + bad_bounds + bad_collisions + refused;
  }
  [[nodiscard]] bool passed() const {
    return bad_certificates() + wrong_verdicts + wrong_boundaries + undecided == 0;
  }
  void add(const VerdictTotals& other);
};

/// One cell of the campaign.
struct VerdictRow {
  std::string pair;
  QueryMode mode = QueryMode::kPath;
  bool aligned = false;
  double noise_rad = 0;  ///< of aligned orientations
  VerdictTotals totals;
};

struct VerdictCampaign {
  std::uint64_t queries = 1000000, judged = 100000;
  std::uint64_t seed = 1;
};

/// Checks one answer: the report of the pair's last tick at `pose_wa`. `judge`: also by the
/// exhaustive search; touching and undecided answers are always judged.
void check_verdict(VerifiedPair& pair, const Pose& pose_wa, const StepResult& result, bool judge,
                   VerdictTotals& totals);

/// Runs the campaign over the pairs: generic orientations and aligned ones with rotation noise 0
/// and 1e-16 to 1e-4 rad in decades; coherent paths, first ticks, jumps. One row per pair,
/// orientation and mode. Deterministic for equal campaigns.
[[nodiscard]] std::vector<VerdictRow> run_verdicts(const VerdictCampaign& campaign,
                                                   const std::vector<VerifiedBodies>& pairs,
                                                   const RunOptions& options);

/// Runs queries of all modes over a pair that exists already, as a campaign of one would; for
/// pairs that were tampered with.
[[nodiscard]] VerdictTotals run_verdicts_on(VerifiedPair& pair, const VerifiedBodies& bodies,
                                            std::uint64_t queries, std::uint32_t judged_one_in,
                                            std::uint64_t seed);

}  // namespace haptic::sim
