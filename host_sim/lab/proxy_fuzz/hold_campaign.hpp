// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The device moves as in the proxy campaign and is then held still: the felt part must come to
/// rest to the last bit, in balance with what it touches, and gain no energy on the way.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "host_sim/lab/proxy_fuzz/proxy_fault.hpp"
#include "host_sim/report/campaign_text.hpp"
#include "host_sim/report/shard_run.hpp"

namespace haptic::sim {

struct HoldSize {
  std::uint64_t poses = 10000;
  std::uint64_t seed = 1;
  std::optional<std::uint64_t> only;  ///< the number of one pose; its ticks go to hold_ticks.csv
  std::optional<ProxyFault> fault;
};

/// One pose.
struct HoldPose {
  std::uint64_t number = 0;
  std::string scene, motion;
  double friction = 0;
  bool device = false;
  std::uint32_t last_change = 0;  ///< tick of the hold in which wrench or part last changed
  std::uint32_t flags = 0;        ///< of the last tick
  Wide residual_n = 0, force_n = 0, largest_rise_j = 0, worst_gap_m = 0;  ///< gap: scaled to 50 mm
  bool moving = false, unbalanced = false, flagged = false, rising = false, deep = false;
  std::string failure;  ///< its poses, where something fails

  [[nodiscard]] bool failed() const { return moving || unbalanced || rising || deep; }
};

struct HoldTotals {
  std::uint64_t poses = 0, held = 0;  ///< held: kept from the goal
  // Each of these must be zero.
  std::uint64_t moving = 0;      ///< wrench or part changes after 0.2 s
  std::uint64_t unbalanced = 0;  ///< residual above 0.01 N and no flag
  std::uint64_t rising = 0;      ///< energy above that at its start by more than 1e-9 J
  std::uint64_t deep = 0;        ///< an end deeper than the tolerance
  std::uint64_t flagged = 0;     ///< residual above 0.01 N, with a flag
  Wide largest_residual_n = 0;   ///< without a flag
  Wide largest_rise_j = 0, worst_gap_m = 0;

  [[nodiscard]] std::uint64_t failed() const { return moving + unbalanced + rising + deep; }
  void add(const HoldPose& pose);
};

struct HoldResult {
  HoldSize size;
  std::vector<HoldPose> poses;
  std::string ticks_csv;  ///< of the only one
  [[nodiscard]] HoldTotals totals() const;
};

[[nodiscard]] HoldResult run_hold(const HoldSize& size, const RunOptions& options);

[[nodiscard]] std::string hold_page(const HoldResult& result);
/// With hold.csv, a line for each pose, hold.json and hold.md; of one pose also hold_ticks.csv.
[[nodiscard]] CampaignEnd hold_end(const HoldResult& result);

}  // namespace haptic::sim
