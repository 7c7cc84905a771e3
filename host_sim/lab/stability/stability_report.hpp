// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Numerical stability on stiff and extreme cases: numbered parts, each with its CSV, table and
/// picture and the limits that must hold.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "host_sim/report/part_report.hpp"
#include "rt_core/scene/scene_format.hpp"

namespace haptic::sim {

struct StabilityOptions {
  bool quick = false;
  std::uint32_t threads = 1;
  bool progress = false;  ///< lines on stderr
  std::vector<LawId> laws = {LawId::kPaper, LawId::kWeightedRegion, LawId::kProxy};

  [[nodiscard]] bool has(LawId law) const;
};

/// One part. `run` gives its files, named after the part, its section of the index, findings
/// ("paper" is what is stated, "ours" what was found) and whether every stated limit holds.
struct StabilityPart {
  int number;
  const char* name;  ///< of its files and on the command line
  PartReport (*run)(const StabilityOptions& options);
};

/// All parts, by number.
[[nodiscard]] std::span<const StabilityPart> stability_parts();

// The parts, one per file part_*.cpp.
[[nodiscard]] PartReport z_width_part(const StabilityOptions& options);     ///< 1
[[nodiscard]] PartReport stiff_part(const StabilityOptions& options);       ///< 2
[[nodiscard]] PartReport continuity_part(const StabilityOptions& options);  ///< 4
[[nodiscard]] PartReport energy_part(const StabilityOptions& options);      ///< 5
[[nodiscard]] PartReport divisions_part(const StabilityOptions& options);   ///< 7

/// Runs the parts with these numbers (all when empty), writes their files and README.md into
/// `folder`, which is made when absent; files appear whole, each as soon as its part is done.
/// @return true when every stated limit holds.
/// @throws tools::InputError when a number is unknown or the folder cannot be written.
[[nodiscard]] bool write_stability(const std::string& folder, const std::vector<int>& numbers,
                                   const StabilityOptions& options);

}  // namespace haptic::sim
