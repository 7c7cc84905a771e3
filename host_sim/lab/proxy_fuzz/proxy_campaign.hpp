// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The campaign against the proxy: every scene with and without friction under every motion, every
/// tick judged. Sharded: equal sizes give equal results, regardless of the number of threads.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "host_sim/lab/proxy_fuzz/fuzz_motion.hpp"
#include "host_sim/lab/proxy_fuzz/proxy_fault.hpp"
#include "host_sim/report/campaign_text.hpp"
#include "host_sim/report/shard_run.hpp"
#include "rt_core/haptic_core.hpp"

namespace haptic::sim {

/// The largest budget of work that a campaign draws.
inline constexpr std::uint32_t kMostFuzzUnits = 10000;

struct ProxyFuzzSize {
  std::uint64_t ticks = 1000000;  ///< over all scenes, rounded up to whole shards
  std::uint64_t seed = 1;
  std::vector<double> frictions = {0.0, 0.3};
  bool paths = true;  ///< half of the ticks have one pass, whose straight way is judged
  /// Every scene has a budget of work of its own, from kLeastWorkUnits to kMostFuzzUnits, and after
  /// every run the device stands still until the part has arrived.
  bool budgets = false;
  std::optional<ProxyFault> fault;
};

struct ProxyFuzzTotals {
  std::uint64_t ticks = 0, held = 0;  ///< held: the proxy is kept from its goal
  // Each of these must be zero.
  std::uint64_t deep = 0;    ///< a pair is deeper than 0.1 um at 50 mm
  std::uint64_t dips = 0;    ///< it is on the straight way of a pass
  std::uint64_t rises = 0;   ///< the energy rose by more than its bound
  std::uint64_t stalls = 0;  ///< ticks beyond the tenth of a run without a move that was possible
  std::uint64_t walls = 0;   ///< kept from the goal though nothing is near
  std::uint64_t crossings = 0;   ///< through a plate
  std::uint64_t wrenches = 0;    ///< not -K g
  std::uint64_t goals = 0;       ///< not the device's pose, or beyond the anchor's limit
  std::uint64_t over_caps = 0;   ///< a counter beyond its cap
  std::uint64_t recoveries = 0;  ///< inside an obstacle, by the core's own account
  std::uint64_t stuck = 0;       ///< the device stood still, and the part did not arrive
  // Figures.
  Wide worst_gap_m = 0, worst_path_m = 0;           ///< at ends, on ways; scaled to a part of 50 mm
  std::uint64_t paths = 0;                          ///< ways of passes that were judged
  Wide largest_rise_j = 0, largest_rise_share = 0;  ///< in J, and of what rounding makes of it
  Wide largest_wrench_error = 0;                    ///< of what rounding makes of it
  std::uint64_t longest_still = 0;                  ///< run of ticks without a move, held
  std::uint64_t longest_stall = 0;     ///< of them possible ones, where looked at (from the 6th on)
  std::uint64_t longest_rejected = 0;  ///< run of ticks of which every pass was rejected
  std::uint64_t rejected_passes = 0, limited = 0, anchored = 0;
  std::uint64_t behind = 0, longest_behind = 0;  ///< ticks that ended for want of budget, in a row
  std::uint64_t longest_arrival = 0;  ///< ticks from the device's standing still to the part's
  StepCounters peaks;
  FailureLog failures;

  [[nodiscard]] std::uint64_t failed() const {
    return deep + dips + rises + stalls + walls + crossings + wrenches + goals + over_caps +
           recoveries + stuck;
  }
  void add(const ProxyFuzzTotals& other);
};

inline constexpr NamedCount<ProxyFuzzTotals> kProxyMustBeZero[] = {
    {"not_free", &ProxyFuzzTotals::deep},
    {"dips", &ProxyFuzzTotals::dips},
    {"energy_rises", &ProxyFuzzTotals::rises},
    {"stalled_ticks", &ProxyFuzzTotals::stalls},
    {"invisible_walls", &ProxyFuzzTotals::walls},
    {"crossings", &ProxyFuzzTotals::crossings},
    {"wrong_wrenches", &ProxyFuzzTotals::wrenches},
    {"wrong_goals", &ProxyFuzzTotals::goals},
    {"over_caps", &ProxyFuzzTotals::over_caps},
    {"recoveries", &ProxyFuzzTotals::recoveries},
    {"stuck", &ProxyFuzzTotals::stuck}};

struct ProxyFuzzRow {
  std::string scene, motion;
  double friction = 0;
  std::uint32_t passes = 0;  ///< in a tick; of 1 the ticks' ways are judged too
  std::uint32_t work_units = 0;
  ProxyFuzzTotals totals;
};

struct ProxyFuzzResult {
  ProxyFuzzSize size;
  std::vector<ProxyFuzzRow> rows;
  double seconds = 0;  ///< of the run
  [[nodiscard]] ProxyFuzzTotals totals() const { return sum_of(rows); }
};

[[nodiscard]] ProxyFuzzResult run_proxy_fuzz(const ProxyFuzzSize& size, const RunOptions& options);

/// The page of proxy_fuzz.md.
[[nodiscard]] std::string proxy_fuzz_page(const ProxyFuzzResult& result);
/// With proxy_fuzz.csv, .json and .md.
[[nodiscard]] CampaignEnd proxy_fuzz_end(const ProxyFuzzResult& result);

}  // namespace haptic::sim
