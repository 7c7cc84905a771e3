// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Runs the core, and the oracle, on the cases of a golden file and compares quantity by quantity.

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "host_sim/oracle/golden_file.hpp"
#include "host_sim/oracle/wide.hpp"
#include "rt_core/haptic_core.hpp"
#include "tools/graph_compiler/graph/scene_writer.hpp"

namespace haptic::sim {

// What a comparison with a golden file counts: quantities, tallies and failures.

// How far the core may be from the golden vectors.

/// Shares of the size of the bodies (the larger diameter). With s the size, l the lever (the larger
/// of s and A's reach from its origin) and D the depth:
///   depth   depth * s
///   force   k_F * max(relative * |D|, force * s)
///   torque  k_F * l * max(relative * |D|, torque * s)
///   SCP     depth * s + relative * |D|
///   normal  max(relative, twice the tolerance of the force / |force|)
struct GoldenTolerance {
  Wide depth = 0, force = 0, torque = 0, relative = 0;
};

/// In double precision 1e-12, and 1e-10 where coordinates exceed 100 sizes (`far_away`), with 1e-9
/// relative. In single precision a row of a table per family,
/// about four times the measured error; families without a row get 1e-6 (2e-2 far away); `relative`
/// is 0.
[[nodiscard]] GoldenTolerance golden_tolerance(const std::string& family, bool far_away);

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

/// Enters single comparisons in a report.
class GoldenComparison {
 public:
  explicit GoldenComparison(GoldenReport& report) : report_(report) {}

  void skip(GoldenQuantity quantity, std::uint64_t count = 1) {
    tally(quantity).not_compared += count;
  }
  void fail(const GoldenCase& c, GoldenQuantity quantity, const std::string& expected,
            const std::string& got);
  /// `unit`: what the error is counted in for the report.
  void within(const GoldenCase& c, GoldenQuantity quantity, Wide error, Wide tolerance,
              const std::string& expected, const std::string& got, Wide unit = 1);
  void equal(const GoldenCase& c, GoldenQuantity quantity, bool same, const std::string& expected,
             const std::string& got);

 private:
  GoldenTally& tally(GoldenQuantity quantity) {
    return report_.tallies[static_cast<std::size_t>(quantity)];
  }
  GoldenReport& report_;
};

/// For messages: all digits that count.
[[nodiscard]] std::string text_of(Wide value);
[[nodiscard]] std::string text_of(const WideVec& v);
[[nodiscard]] std::string text_of(std::span<const std::uint32_t> list);

/// The scene of a golden file: A moving with its grip point at its frame's origin, B fixed, law
/// paper, `epsilon_m`.
[[nodiscard]] tools::SceneDescription golden_scene(const GoldenFile& file, double epsilon_m);

/// The pose of a case as the core is given it.
[[nodiscard]] StepInput input_of_case(const GoldenCase& c);

/// Width of the near set for a file: below every gap to the next depth and every violation of a
/// rejected node (a quarter of the smallest), at most 1e-9 of the size, and not below 64 roundings
/// of the largest coordinate. [m]
[[nodiscard]] double golden_epsilon_m(const GoldenFile& file);

/// Tolerances: tolerance_of, for the file's family. Torque is compared where margin_m >
/// 1e-6 of 0.1 m scaled to the size. D_near = 0 exactly: both verdicts are right.
/// @throws tools::InputError when the bodies are no convex pieces.
[[nodiscard]] GoldenReport check_golden_file(const GoldenFile& file);

}  // namespace haptic::sim
