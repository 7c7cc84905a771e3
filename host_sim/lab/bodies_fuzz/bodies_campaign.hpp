// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The campaign against several moving bodies: every scene of the cases with and without friction,
/// every tick and every step judged. Sharded: equal sizes give equal results, regardless of the
/// number of threads.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "host_sim/lab/bodies_fuzz/bodies_session.hpp"
#include "host_sim/lab/bodies_fuzz/bodies_totals.hpp"
#include "host_sim/report/campaign_text.hpp"
#include "host_sim/report/shard_run.hpp"

namespace haptic::sim {

struct BodiesFuzzSize {
  std::vector<std::string> cases;  ///< names of bodies_case_names(); empty: all
  std::uint64_t ticks = 200000;    ///< over all scenes, rounded up to whole runs; rests on top
  std::uint64_t seed = 1;
  std::vector<double> frictions = {0.0, 0.3};
  std::uint32_t work_units = 0;       ///< budget of a tick; 0: none
  std::optional<std::uint64_t> only;  ///< the run of this number alone, as a failure names it
  std::optional<BodiesFault> fault;
  std::string scene;  ///< a compiled scene in place of the cases; empty: none
};

struct BodiesFuzzRow {
  std::string of_case, scene;
  double friction = 0;
  std::size_t pairs = 0;  ///< of bodies, compiled
  BodiesTotals totals;
};

struct BodiesFuzzResult {
  BodiesFuzzSize size;
  std::vector<BodiesFuzzRow> rows;
  double seconds = 0;  ///< of the run
  [[nodiscard]] BodiesTotals totals() const { return sum_of(rows); }
};

/// @throws tools::InputError when a pair cannot be compiled; no run has the number of `only`.
[[nodiscard]] BodiesFuzzResult run_bodies_fuzz(const BodiesFuzzSize& size,
                                               const RunOptions& options);

/// The page of the campaign.
[[nodiscard]] std::string bodies_fuzz_page(const BodiesFuzzResult& result);
/// With its files: bodies_fuzz.csv, .json and a page.
[[nodiscard]] CampaignEnd bodies_fuzz_end(const BodiesFuzzResult& result);

}  // namespace haptic::sim
