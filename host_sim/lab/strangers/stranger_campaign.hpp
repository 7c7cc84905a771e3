// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Families by seeds by clearances, each pair tried as a stranger would, and the tables of it.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "host_sim/lab/strangers/stranger_trial.hpp"
#include "host_sim/report/part_report.hpp"
#include "host_sim/report/shard_run.hpp"

namespace haptic::sim {

struct StrangerCampaign {
  std::vector<std::string> families;  ///< empty: all
  std::vector<std::uint64_t> seeds{1};
  std::vector<double> clearances_mm;  ///< empty: drawn, one for a family and seed
  bool every_clearance = false;       ///< all that belong to a family
  TrialOptions trial;
};

/// The pairs of a campaign, in the order of its tables. @throws tools::UsageError  no such family.
[[nodiscard]] std::vector<StrangerPair> campaign_pairs(const StrangerCampaign& campaign);
/// `done` is called with each as it ends, one at a time.
[[nodiscard]] std::vector<StrangerTrial> run_strangers(
    const StrangerCampaign& campaign, const RunOptions& options,
    const std::function<void(const StrangerTrial&)>& done);

/// "right  keyed_shaft  seed 1  0.05 mm  ..": a line of the command's output.
[[nodiscard]] std::string trial_line(const StrangerTrial& trial);
/// strangers.csv (a row per pair and motion), strangers.md.
[[nodiscard]] std::vector<OutputText> stranger_files(const std::vector<StrangerTrial>& trials);

}  // namespace haptic::sim
