// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Runs methods over a workload and times them.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "host_sim/lab/peers/peer_catalog.hpp"
#include "host_sim/lab/peers/peer_query.hpp"
#include "host_sim/oracle/near_reference.hpp"
#include "host_sim/report/part_report.hpp"
#include "host_sim/session/tick_clock.hpp"
#include "host_sim/shapes/contact_workload.hpp"
#include "host_sim/shapes/shapes.hpp"

namespace haptic::sim {

// Error against run time: one line of the result, and how it follows from what a method answered
// at each pose.

/// Where a pose is, by the reference.
enum class PairState : std::uint8_t {
  kContact,  ///< D_near <= 0
  kNear,     ///< below kNearState_m
  kFar
};
inline constexpr double kNearState_m = 5e-3;
inline constexpr double kShallow_m = 5e-3;  ///< `max_error_m` is over poses up to this deep
/// A verdict counts as wrong when |D_near| is larger than this.
inline constexpr double kVerdictBand_m = 1e-6;

[[nodiscard]] PairState state_of(const NearTruth& truth);
[[nodiscard]] const char* to_text(PairState state);

/// One method at one pose.
struct PoseSample {
  std::size_t pose = 0;  ///< index of its truth
  double tick_ns = 0;    ///< least of the passes, clock subtracted
  double query_ns = 0;   ///< of the geometric query alone
  double heap_calls = 0;
  PeerAnswer answer;
};

/// One line. NaN: the method gives no such value, or none was measured; an empty cell in the CSV.
struct ParetoRow {
  std::string pair, method, setting, scalar, state;
  double query_ns = 0, median_ns = 0, p99_ns = 0, p999_ns = 0, max_ns = 0;
  double median_error_m = 0, max_error_m = 0, max_error_deep_m = 0, normal_error_deg = 0;
  std::uint64_t wrong_verdicts = 0;
  double patch_points = 0;  ///< mean over the poses that the method calls penetrating
  double heap_calls = 0;    ///< mean over the poses
  std::uint64_t poses = 0;
  std::uint64_t wrong_verdicts_beyond_1nm = 0;
};

/// A line for each state that has samples. `truths`: by pose index. Errors: inside of the depth
/// against D_near; outside of plane values alone, against the range that D_near may have there.
/// Names (`pair` to `scalar`) are the caller's.
[[nodiscard]] std::vector<ParetoRow> rows_of(std::span<const PoseSample> samples,
                                             std::span<const NearTruth> truths);

/// For JSON.
[[nodiscard]] ReportTable pareto_rows(std::span<const ParetoRow> rows);
/// The whole file, header first. Lines end in \n.
[[nodiscard]] std::string pareto_csv(std::span<const ParetoRow> rows);

// The six pairs of convex bodies that methods are compared on, from the paper's to half a million
// basic contacts. Parts of 3 to 10 cm, made here from seeds.

struct PairClass {
  std::string name;     ///< W1 to W6
  std::string content;  ///< in words
  Solid a, b;
  std::uint64_t nodes = 0;  ///< basic contacts: F_A V_B + V_A F_B + E_A E_B
  bool boxes = false;
};

/// All six, in order of their nodes: 128, 240, 688, 11940, 50468, 511236. The hulls follow from
/// `seed`; their counts do not.
[[nodiscard]] std::vector<PairClass> pair_classes(std::uint64_t seed);

/// F_A V_B + V_A F_B + E_A E_B of closed bodies.
[[nodiscard]] std::uint64_t basic_contact_count(const Solid& a, const Solid& b);

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
