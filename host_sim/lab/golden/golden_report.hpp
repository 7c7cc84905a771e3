// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What a comparison with a golden file counts: quantities, tallies and failures.

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "host_sim/lab/golden/golden_tolerance.hpp"
#include "host_sim/oracle/golden_file.hpp"

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
  kWeights,  ///< weighted region: of every node
  kWeightedForce,
  kWeightedTorque,
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

}  // namespace haptic::sim
