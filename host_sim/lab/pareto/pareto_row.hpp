// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Error against run time: one line of the result, and how it follows from what a method answered
/// at each pose.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "host_sim/oracle/near_reference.hpp"
#include "host_sim/lab/peers/peer_query.hpp"

namespace haptic::sim {

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

/// The columns, in the order of the CSV.
inline constexpr const char* kParetoHeader =
    "pair,method,setting,scalar,state,query_ns,median_ns,p99_ns,p999_ns,max_ns,median_error_m,"
    "max_error_m,max_error_deep_m,normal_error_deg,wrong_verdicts,patch_points,heap_calls";

/// A line for each state that has samples. `truths`: by pose index. Errors: inside of the depth
/// against D_near; outside of plane values alone, against the range that D_near may have there.
/// Names (`pair` to `scalar`) are the caller's.
[[nodiscard]] std::vector<ParetoRow> rows_of(std::span<const PoseSample> samples,
                                             std::span<const NearTruth> truths);

/// The whole file, header first. Lines end in \n.
[[nodiscard]] std::string pareto_csv(std::span<const ParetoRow> rows);

}  // namespace haptic::sim
