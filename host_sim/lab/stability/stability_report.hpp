// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Numerical stability on stiff and extreme cases: numbered parts, each with its CSV, table and
/// picture and the limits that must hold.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "host_sim/report/part_report.hpp"
#include "rt_core/base/scalar.hpp"
#include "rt_core/scene/scene_format.hpp"

namespace haptic::sim {

struct StabilityOptions {
  bool quick = false;
  std::uint32_t threads = 1;
  bool progress = false;  ///< lines on stderr
  std::vector<LawId> laws = {LawId::kPaper, LawId::kProxy};

  [[nodiscard]] bool has(LawId law) const;
};

/// One part. `run` gives its files, named after the part, its section of the index, findings
/// ("paper" is what is stated, "ours" what was found) and whether every stated limit holds.
struct StabilityPart {
  int number;
  const char* name;  ///< of its files and on the command line
  PartReport (*run)(const StabilityOptions& options);
};

/// The parts of this build, by number.
[[nodiscard]] std::vector<StabilityPart> stability_parts();
/// Those of lab/studies; empty where they are not built.
[[nodiscard]] std::span<const StabilityPart> study_parts();

// The parts, one per file part_*.cpp.
[[nodiscard]] PartReport z_width_part(const StabilityOptions& options);     ///< 1
[[nodiscard]] PartReport continuity_part(const StabilityOptions& options);  ///< 4
[[nodiscard]] PartReport energy_part(const StabilityOptions& options);      ///< 5
[[nodiscard]] PartReport divisions_part(const StabilityOptions& options);   ///< 7
[[nodiscard]] PartReport defaults_part(const StabilityOptions& options);    ///< 8

/// Runs the parts with these numbers (all of this build when empty), writes their files and
/// README.md into `folder`, which is made when absent; files appear whole, each as soon as its part
/// is done.
/// @return true when every stated limit holds.
/// @throws tools::UsageError when a number is unknown, or of a study that is not built;
/// tools::InputError when the folder cannot be written.
[[nodiscard]] bool write_stability(const std::string& folder, const std::vector<int>& numbers,
                                   const StabilityOptions& options);

// Part 6 of the stability report: a square peg in a hole of five pieces, clearance from 1 mm down
// to 10 um, with and without friction.

/// Stated limits. The peg reaches the floor in the swaying insertion; pressed sideways it stands
/// off the wall by nothing, so its way is the clearance; tilted and pushed it follows without
/// friction and else lags by what sliding on two points holds. Largest steps of force and torque
/// halve with the step, but where the swaying peg sticks and slips: such a slip releases at most a
/// share of what friction held.
struct ClearanceLimits {
  double offset_m = 1e-6;
  double floor_m = 1e-6;         ///< of the peg's lowest corner over the floor
  double free_lag_m = 1e-4;      ///< without friction
  double friction_share = 0.02;  ///< of the force that sliding on two points gives
  double least_ratio = 1.5;      ///< of the largest steps when the step is halved
  double slip_share = 0.25;      ///< largest force step over friction times largest wall force
  /// Smaller steps need not halve: k_t, or k_r over 5 mm, times twice the depth that counts as
  /// free, which in single precision is 0.7 um.
  double still_force_n = HAPTIC_REAL_IS_FLOAT ? 2e-3 : 1e-3;
  double still_torque_nm = HAPTIC_REAL_IS_FLOAT ? 3e-4 : 1e-5;
};

/// Files clearance.{csv,md,svg}. `quick`: widest and narrowest clearance, no and most friction.
[[nodiscard]] PartReport clearance_part(bool quick, const ClearanceLimits& limits = {});

// Part 3 of the stability report: extreme geometry. Depth and normal against the exhaustive search
// in long double, the wrench of a pressed contact against its closed form, and what is refused.

/// Runs every scene and contact in the scalar of this build; files extreme.{csv,md,svg} and
/// extreme_press.csv. Passes when nothing failed and what must be refused is.
/// Cost: about 25000 poses and 60000 ticks, most of it the search in long double; `quick`: a
/// fortieth.
[[nodiscard]] PartReport extreme_part(bool quick);

}  // namespace haptic::sim
