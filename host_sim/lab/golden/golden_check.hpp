// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Runs the core, and the oracle, on the cases of a golden file and compares quantity by quantity.

#include "host_sim/lab/golden/golden_report.hpp"
#include "host_sim/oracle/golden_file.hpp"
#include "rt_core/haptic_core.hpp"
#include "tools/graph_compiler/graph/scene_writer.hpp"

namespace haptic::sim {

/// The scene of a golden file: A moving with its grip point at its frame's origin, B fixed, law
/// paper, `epsilon_m`.
[[nodiscard]] tools::SceneDescription golden_scene(const GoldenFile& file, double epsilon_m);

/// Compares the weighted contact region where the file gives it: the weight of every node, force
/// and torque, from a core with that law and the file's eps and eps_o (golden_weighted.cpp).
/// `report`: as far as the paper's law has filled it.
void check_weighted_region(const GoldenFile& file, GoldenReport& report);

/// The pose of a case as the core is given it.
[[nodiscard]] StepInput input_of_case(const GoldenCase& c);

/// Width of the near set for a file: below every gap to the next depth and every violation of a
/// rejected node (a quarter of the smallest), at most 1e-9 of the size, and not below 64 roundings
/// of the largest coordinate. [m]
[[nodiscard]] double golden_epsilon_m(const GoldenFile& file);

/// Tolerances: golden_tolerance.hpp, for the file's family. Torque is compared where margin_m >
/// 1e-6 of 0.1 m scaled to the size. D_near = 0 exactly: both verdicts are right.
/// @throws tools::InputError when the bodies are no convex pieces.
[[nodiscard]] GoldenReport check_golden_file(const GoldenFile& file);

}  // namespace haptic::sim
