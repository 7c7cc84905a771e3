// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Runs methods over a workload and times them.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "host_sim/shapes/contact_workload.hpp"
#include "host_sim/lab/pareto/pair_class.hpp"
#include "host_sim/lab/pareto/pareto_row.hpp"
#include "host_sim/lab/peers/peer_catalog.hpp"
#include "host_sim/session/tick_clock.hpp"

namespace haptic::sim {

inline constexpr const char* kFirstTickSetting = "first tick";

/// Allocations of this thread so far; null where the program does not count them.
using HeapCounter = std::uint64_t (*)();

struct MeasurePlan {
  std::uint32_t passes = 7;
  /// A method whose time is that of the nodes is run on every n-th pose, so that poses times nodes
  /// stay below this.
  std::uint64_t node_visits = 2'500'000'000;
  /// First ticks are measured on at most this many poses, spread over the workload, and on fewer
  /// where poses times nodes would exceed a 64th of `node_visits`.
  std::size_t first_ticks = 500;
  HeapCounter heap_calls = nullptr;
};

/// A pair with its motion and what is true at each of its poses.
struct TruthfulWorkload {
  ContactWorkload motion;
  std::vector<PeerPose> poses;
  std::vector<NearTruth> truths;

  [[nodiscard]] double penetrating_share() const;
};

[[nodiscard]] TruthfulWorkload truthful_workload(const PairClass& pair, std::size_t pose_count,
                                                 std::uint64_t seed);

/// Each pose `plan.passes` times, in the order of the motion, the method reset at the start of each
/// recording of each pass; the least time of a pose counts. Where the method is coherent the first
/// pose of a recording is left out: it is a first tick.
[[nodiscard]] std::vector<PoseSample> measure_motion(PeerQuery& peer,
                                                     const TruthfulWorkload& workload,
                                                     std::size_t stride, const MeasurePlan& plan,
                                                     const TickClock& clock);

/// Poses `stride` apart, the method reset before each query.
[[nodiscard]] std::vector<PoseSample> measure_first_ticks(PeerQuery& peer,
                                                          const TruthfulWorkload& workload,
                                                          std::size_t stride,
                                                          const MeasurePlan& plan,
                                                          const TickClock& clock);

/// All that one method gave on one pair.
struct MethodResult {
  std::vector<ParetoRow>
      rows;  ///< the setting's own; kFirstTickSetting for a coherent method's drawn one
  std::vector<double> contact_ns;  ///< ascending, without first ticks
  std::size_t stride = 1;
  std::string refusal;  ///< why there are no rows
};

[[nodiscard]] MethodResult measure_method(const PeerEntry& entry, const PairClass& pair,
                                          const TruthfulWorkload& workload, const MeasurePlan& plan,
                                          const TickClock& clock);

}  // namespace haptic::sim
