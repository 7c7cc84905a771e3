// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Thin parts driven at and through thin obstacles while they turn through parallel. The core runs
/// with one pass in a tick, three ticks for each pose of the device, so that the straight way of
/// every pass is seen; and once more with its shipped passes, of which the ends are judged.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "host_sim/lab/proxy_fuzz/proxy_fault.hpp"
#include "host_sim/report/campaign_text.hpp"
#include "host_sim/report/shard_run.hpp"

namespace haptic::sim {

struct CrossingSize {
  std::uint64_t crossings = 1000;  ///< of random shapes, thicknesses, speeds; 4 for 10 more of two
                                   ///< rods of 0.2 mm at 1.2 m/s and of nearly parallel edges
  std::uint64_t seed = 1;
  std::optional<std::uint64_t> only;  ///< the number of one crossing
  std::optional<ProxyFault> fault;
};

/// One crossing, or all of a group.
struct CrossingTotals {
  std::uint64_t crossings = 0, met = 0;  ///< met: the obstacle held the part
  std::uint64_t paths = 0, ends = 0;     ///< judged
  // Each of these must be zero.
  std::uint64_t through = 0;               ///< a way sinks in by a tenth of the thinner one
  std::uint64_t dips = 0;                  ///< by less, but beyond the tolerance
  std::uint64_t deep = 0;                  ///< an end does
  Wide worst_end_m = 0, worst_path_m = 0;  ///< scaled to a part of 50 mm
  FailureLog failures;

  [[nodiscard]] std::uint64_t failed() const { return through + dips + deep; }
  void add(const CrossingTotals& other);
};

struct CrossingRow {
  std::string group;
  CrossingTotals totals;
};

struct CrossingResult {
  CrossingSize size;
  std::vector<CrossingRow> rows;
  [[nodiscard]] CrossingTotals totals() const { return sum_of(rows); }
};

/// @throws tools::InputError no crossing has the number of `only`.
[[nodiscard]] CrossingResult run_crossings(const CrossingSize& size, const RunOptions& options);

[[nodiscard]] std::string crossings_page(const CrossingResult& result);
/// With crossings.csv, .json and .md.
[[nodiscard]] CampaignEnd crossings_end(const CrossingResult& result);

}  // namespace haptic::sim
