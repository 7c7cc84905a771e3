// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Verification of what the core returns, by code that shares nothing with it: verdicts and their
/// certificates, D_near, near sets. Every count that must be zero is named in the report.

#include <cstdint>
#include <string>
#include <vector>

#include "host_sim/lab/verification/depth_campaign.hpp"
#include "host_sim/lab/verification/near_campaign.hpp"
#include "host_sim/lab/verification/verdict_campaign.hpp"
#include "host_sim/report/campaign_text.hpp"

namespace haptic::sim {

struct VerificationSize {
  std::uint64_t queries = 1000000;  ///< verdicts
  std::uint64_t judged = 100000;    ///< of them by the exhaustive search
  std::uint64_t ticks = 200000;     ///< of D_near
  std::uint64_t near_poses = 100000;
  std::uint64_t seed = 1;

  /// Small counts on the same pairs: a few seconds.
  [[nodiscard]] static VerificationSize quick() { return {12000, 3000, 6000, 3000, 1}; }
};

struct VerificationResult {
  VerificationSize size;
  std::vector<VerdictRow> verdicts;
  std::vector<DepthRow> depths;
  std::vector<NearRow> near_sets;

  [[nodiscard]] VerdictTotals verdict_totals() const { return sum_of(verdicts); }
  [[nodiscard]] DepthTotals depth_totals() const { return sum_of(depths); }
  [[nodiscard]] NearTotals near_totals() const { return sum_of(near_sets); }
  [[nodiscard]] bool passed() const;
};

/// Runs all three campaigns. Equal sizes give equal results, regardless of the number of threads.
[[nodiscard]] VerificationResult run_verification(const VerificationSize& size,
                                                  const RunOptions& options);

/// The page of verify.md.
[[nodiscard]] std::string verification_page(const VerificationResult& result);

/// With verify.json, verify.md, verify_verdicts.csv, verify_d_near.csv, verify_near_sets.csv for
/// `folder`.
[[nodiscard]] CampaignEnd verification_end(const VerificationResult& result,
                                           const std::string& folder);

}  // namespace haptic::sim
