// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Tables and pictures of the continuity measurement.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "host_sim/report/part_report.hpp"
#include "host_sim/shapes/contact_path.hpp"

namespace haptic::sim {

// The core on a contact path: how much the wrench changes from step to step, and whether that
// falls as the steps get smaller.

/// One path under one law in steps of equal size.
struct PathRun {
  LawId law = LawId::kPaper;
  std::uint32_t steps = 0;
  double largest_torque_step_nm = 0;
  double largest_torque_step_at = 0;              ///< parameter at its end
  Vector largest_torque_step_w = Vector::Zero();  ///< the step itself, W axes [N m]
  double largest_force_step_n = 0;
  std::vector<double> parameter;  ///< of each pose, steps + 1 of them
  std::vector<Vector> torque_w;   ///< at each pose, about x_0^A, W axes [N m]
};

/// Runs the core over the path from a first tick on. @throws tools::InputError when the scene or a
/// pose is refused.
[[nodiscard]] PathRun run_path(const ContactPath& path, LawId law, std::uint32_t steps);

/// All runs of one path, finer and finer, the laws side by side.
struct PathResult {
  ContactPath path;
  std::vector<PathRun> paper, weighted;  ///< by steps, ascending
};

/// Runs every path under both laws, in 250, 1000, 4000 and 16000 steps; `quick`: in the two numbers
/// of steps alone that `settles` looks at. Cost: two ticks per path and step.
[[nodiscard]] std::vector<PathResult> run_paths(bool quick);

/// How many times smaller the largest torque step of run `k` is than that of run `k - 1`; a law
/// without jumps gives the ratio of the steps. 0 for the first run and where nothing moves.
[[nodiscard]] double ratio_to_previous(std::span<const PathRun> runs, std::size_t k);

/// Torque steps below this are rounding: nothing moves. [N m]
inline constexpr double kStillTorque_nm = HAPTIC_REAL_IS_FLOAT ? 1e-4 : 1e-10;

/// Least ratio, for steps four times smaller, that a law without jumps must show where the steps
/// are fine. A jump gives 1, a slope 4; what is left is for a slope that changes within a step.
inline constexpr double kLeastRatio = 3.0;

/// Whether the torque is continuous as far as steps can tell: every ratio from `fine_steps` on is
/// kLeastRatio or more, or nothing moves.
[[nodiscard]] bool settles(std::span<const PathRun> runs, std::uint32_t fine_steps);

/// continuity.csv: path, law, steps, largest steps of torque and force, ratio to the run before.
[[nodiscard]] std::string continuity_csv(std::span<const PathResult> results);

/// continuity.json: the same, with the parameters and the verdict of every path.
[[nodiscard]] std::string continuity_json(std::span<const PathResult> results);

/// README.md: the table in mN m, the pictures, and how to read them.
[[nodiscard]] std::string continuity_page(std::span<const PathResult> results);

/// |torque| over the path under both laws, finest runs.
[[nodiscard]] std::string torque_picture(const PathResult& result);

/// Largest torque step over the number of steps, all paths, both axes logarithmic.
[[nodiscard]] std::string step_picture(std::span<const PathResult> results);

/// All files, by name.
[[nodiscard]] std::vector<OutputText> continuity_files(std::span<const PathResult> results);

/// Whether the weighted law settles on every path.
[[nodiscard]] bool continuous(std::span<const PathResult> results);

}  // namespace haptic::sim
