// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/verification/verification.hpp"

namespace haptic::sim {

VerdictTotals VerificationResult::verdict_totals() const {
  VerdictTotals totals;
  for (const VerdictRow& row : verdicts) totals.add(row.totals);
  return totals;
}

DepthTotals VerificationResult::depth_totals() const {
  DepthTotals totals;
  for (const DepthRow& row : depths) totals.add(row.totals);
  return totals;
}

NearTotals VerificationResult::near_totals() const {
  NearTotals totals;
  for (const NearRow& row : near_sets) totals.add(row.totals);
  return totals;
}

bool VerificationResult::passed() const {
  return verdict_totals().passed() && depth_totals().passed() && near_totals().passed();
}

VerificationResult run_verification(const VerificationSize& size, const RunOptions& options) {
  VerificationResult result;
  result.size = size;
  const std::vector<VerifiedBodies> classes = class_pairs();
  std::vector<VerifiedBodies> all = classes;
  for (VerifiedBodies& bodies : sliver_pairs()) all.push_back(std::move(bodies));
  if (size.queries > 0)
    result.verdicts = run_verdicts({size.queries, size.judged, size.seed}, all, options);
  if (size.ticks > 0) result.depths = run_depths({size.ticks, size.seed}, classes, options);
  if (size.near_poses > 0)
    result.near_sets = run_near_sets({size.near_poses, size.seed}, classes, options);
  return result;
}

}  // namespace haptic::sim
