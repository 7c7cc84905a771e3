// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The account of a replay, for people and as JSON.

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host_sim/oracle/scene_oracle.hpp"
#include "host_sim/session/contact_reference.hpp"
#include "host_sim/session/drive_run.hpp"
#include "host_sim/session/tick_csv.hpp"

namespace haptic::sim {

/// Counts over all ticks of a run. "Change" is between two ticks that follow each other.
struct ReplayTotals {
  std::uint64_t ticks = 0, contact_ticks = 0, situation_changes = 0, refused_poses = 0;
  std::uint32_t pair_count = 0;
  double duration_s = 0;
  double largest_force_n = 0, largest_torque_nm = 0;
  double largest_force_change_n = 0, largest_torque_change_nm = 0;
  double smallest_d_near_m = 0;
  double nodes_mean = 0;
  std::uint32_t nodes_largest = 0, nodes_bound = 0;
  std::uint32_t support_pairs_largest = 0, support_pairs_bound = 0;
  std::uint64_t relocalised_pair_ticks = 0;  ///< after the first tick
  std::uint64_t pair_ticks = 0;              ///< after the first tick
  std::array<std::uint64_t, static_cast<std::size_t>(ContactSituation::kCount)> situation_ticks{};
  std::array<std::uint64_t, kFlagCount> flag_ticks{};  ///< by bit
  std::uint64_t final_hash = 0;

  /// A count over its bound in the scene's header is a failed check.
  [[nodiscard]] bool within_bounds() const {
    return nodes_largest <= nodes_bound && support_pairs_largest <= support_pairs_bound;
  }
};

/// `capacity`: bounds from the scene's header.
[[nodiscard]] ReplayTotals total(std::span<const TickRecord> ticks, const SceneCapacity& capacity);

/// Everything a replay reports; parts that were not asked for are empty.
struct ReplayReport {
  std::string scene, motion, mode;  ///< mode: "core" or the name of the literal reading
  ReplayTotals totals;
  std::optional<CheckTotals> check;
  std::optional<ReferenceTotals> reference;
  std::optional<tools::SessionVerdict> verdict;
  bool bounded = true;  ///< every count of the core within its bound
  std::vector<DrivenAccount> driven;
  std::string lost;  ///< driven parts whose streams were lost (DriveRun::failures)

  [[nodiscard]] bool passed() const;
};

/// Lines for people; the last one is the verdict.
[[nodiscard]] std::string text_summary(const ReplayReport& report);
/// One JSON object, two spaces of indent, keys in a fixed order.
[[nodiscard]] std::string json_summary(const ReplayReport& report);

using tools::flag_name;
using tools::flag_names;

}  // namespace haptic::sim
