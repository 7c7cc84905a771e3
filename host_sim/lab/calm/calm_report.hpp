// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What a hand feels of sampling, delay and encoders: a part is pressed 8 mm in, held for 2 s and
/// withdrawn at 0.1 m/s, by every hand and with every encoder, with the passivity layer and
/// without: with the gains that a scene with this device gets, and with those that it asks for, in
/// spite of the device's budget.

#include <span>
#include <string>
#include <vector>

#include "host_sim/report/part_report.hpp"

namespace haptic::sim {

struct CalmCell {
  std::string contact;        ///< "wall": a cube on a wall; "peg": on floor and walls of its hole
  double k_t_n_per_m = 1000;  ///< that the scene asks for
  bool allow_active = false;  ///< it gets it: no budget
  unsigned delay_samples = 0;
  double encoder_step_m = 0;  ///< and kEncoderLever_m of it per radian
  std::string hand = "light";
};

/// Lever at which an encoder of rotation is as fine as that of translation [m].
inline constexpr double kEncoderLever_m = 0.050;

/// Of one run.
struct CalmRun {
  double rest_pp_n = 0;      ///< peak to peak over the last half second of the hold, largest axis
  unsigned free_ticks = 0;   ///< with a force though the spring is relaxed, from the second one on
  double free_n = 0;         ///< largest of them
  double pull_n = 0;         ///< largest force against the spring's
  unsigned acted_ticks = 0;  ///< of the passivity layer, in the whole run
};

struct CalmResult {
  CalmCell cell;
  double k_t_n_per_m = 0, k_r_nm_per_rad = 0, damping_ns_per_m = 0;  ///< what the scene has got
  bool inside = false;      ///< K T (1/2 + d) < b, in translation and in rotation
  double allowed_pp_n = 0;  ///< 1.5 counts times stiffness, of the axes that reach the force
  CalmRun without, with;    ///< the layer
  bool same_bits = false;   ///< every rendered wrench of both runs
  std::vector<double> t_s, force_n;  ///< along the press, with the layer
  /// Nothing in free space and no pull; with the compiler's gains rest, and the bits of the run
  /// without the layer where sampling makes no energy.
  [[nodiscard]] bool passed() const;
};

/// The layer as a last resort, over the cells beyond the budget: how many of them do not rest.
struct LastResort {
  unsigned cells = 0, without = 0, with = 0;
  double largest_without_n = 0, largest_n = 0;
  [[nodiscard]] bool passed() const { return with <= without && largest_n <= largest_without_n; }
};
[[nodiscard]] LastResort last_resort(std::span<const CalmResult> results);

/// All cells; `quick`: the corners of the table.
[[nodiscard]] std::vector<CalmCell> calm_cells(bool quick);
/// @throws tools::InputError when the gains are refused.
[[nodiscard]] CalmResult run_calm(const CalmCell& cell);
/// Table as CSV, JSON and Markdown, and a picture.
[[nodiscard]] std::vector<OutputText> calm_files(std::span<const CalmResult> results);

}  // namespace haptic::sim
