// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Runs the core, and the oracle, on the cases of a golden file and compares quantity by quantity.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "host_sim/commands/golden_tolerance.hpp"
#include "host_sim/oracle/golden_file.hpp"
#include "tools/graph_compiler/graph/scene_writer.hpp"

namespace haptic::sim {

enum class GoldenQuantity : std::uint8_t {
  kVerdict,
  kDepth,
  kNearSet,
  kNearNormal,
  kScp,
  kForce,
  kTorque,
  kContactNodes,
  kCoherentVerdict,  ///< path files: the cases as one motion, without a reset between them
  kCoherentDepth,
  kCoherentNearSet,
  kOracleDepthByNode,  ///< the oracle against the file: these check the judge itself
  kOracleApplicable,
  kOracleRatio,
  kOracleDepth,
  kOtherRules,  ///< results of rules that the core does not render
  kCount
};

[[nodiscard]] const char* to_text(GoldenQuantity quantity);

struct GoldenTally {
  std::uint64_t compared = 0, not_compared = 0, failed = 0;
  double worst_ratio =
      0;  ///< largest error divided by its tolerance; sets: 0 equal, infinite different
  double worst_error = 0;  ///< largest error in the shares of GoldenTolerance; sets: 0
};

struct GoldenReport {
  std::string path, family;
  std::uint64_t cases = 0;
  double size_m = 0, epsilon_m = 0, depth_tolerance_m = 0;
  GoldenTolerance tolerance;
  std::array<GoldenTally, static_cast<std::size_t>(GoldenQuantity::kCount)> tallies{};
  std::vector<std::string> failures;  ///< file, case, quantity, expected, got

  [[nodiscard]] bool passed() const { return failures.empty(); }
};

/// The scene of a golden file: A moving with its grip point at its frame's origin, B fixed, law
/// paper, `epsilon_m`.
[[nodiscard]] tools::SceneDescription golden_scene(const GoldenFile& file, double epsilon_m);

/// Width of the near set for a file: below every gap to the next depth and every violation of a
/// rejected node (a quarter of the smallest), at most 1e-9 of the size, and not below 64 roundings
/// of the largest coordinate. [m]
[[nodiscard]] double golden_epsilon_m(const GoldenFile& file);

/// Tolerances: golden_tolerance.hpp, for the file's family. Torque is compared where margin_m >
/// 1e-6 of 0.1 m scaled to the size. D_near = 0 exactly: both verdicts are right.
/// @throws tools::InputError when the bodies are no convex pieces.
[[nodiscard]] GoldenReport check_golden_file(const GoldenFile& file);

}  // namespace haptic::sim
