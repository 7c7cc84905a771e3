// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Tables and pictures of the continuity measurement.

#include <span>
#include <string>
#include <vector>

#include "host_sim/lab/continuity/path_run.hpp"
#include "host_sim/report/part_report.hpp"

namespace haptic::sim {

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
