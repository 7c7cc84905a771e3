// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Overlap at the device's pose as found elsewhere (`t,contact` with 1, 0 or u) against the
/// verdicts of a replay, D_near <= 0; whether the felt part touches is another question.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "host_sim/session/tick_csv.hpp"

namespace haptic::sim {

enum class ReferenceFlag : std::uint8_t { kFree, kContact, kUndecided };

struct ReferenceSample {
  double t_s = 0;
  ReferenceFlag flag = ReferenceFlag::kUndecided;
};

struct ReferenceTotals {
  std::uint64_t contact = 0, free = 0;  ///< decided samples
  std::uint64_t undecided = 0;
  std::uint64_t wrong = 0;      ///< decided samples with the other verdict
  std::uint64_t unmatched = 0;  ///< no tick at that time
  double first_wrong_t_s = 0;   ///< valid when wrong > 0
};

/// @throws tools::InputError with file and line.
[[nodiscard]] std::vector<ReferenceSample> read_contact_reference(const std::string& path);

/// Compares each sample with the tick nearest in time, if it lies within `tolerance_s`. Contact
/// means d_near <= 0. Both lists ascend in time. O(samples + ticks).
[[nodiscard]] ReferenceTotals compare_with_reference(std::span<const ReferenceSample> samples,
                                                     std::span<const TickRecord> ticks,
                                                     double tolerance_s);

}  // namespace haptic::sim
