// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Faults put into the core's memory on purpose, to show that the checks of the verification can
/// fail: each is run on sound tables first and on damaged ones then.

#include <cstdint>
#include <optional>
#include <string>

#include "host_sim/report/campaign_text.hpp"

namespace haptic::sim {

enum class DeliberateFault {
  kKey,     ///< the stored bound of a face, lowered by one micrometre
  kArc,     ///< one arc of the contact graph, removed in both directions
  kSupport  ///< one entry of the table that supports are searched in, overwritten
};

/// "key", "arc", "support".
[[nodiscard]] std::optional<DeliberateFault> fault_named(const std::string& name);

struct FaultOutcome {
  std::uint64_t checks = 0;          ///< near sets or verdicts compared, each time
  std::uint64_t sound_failures = 0;  ///< must be 0
  std::uint64_t fault_failures = 0;  ///< 0: the fault was not caught
  std::string first_failure;         ///< what the check said

  [[nodiscard]] bool caught() const { return sound_failures == 0 && fault_failures > 0; }
};

/// Runs the checks without and with the fault. Seconds.
[[nodiscard]] FaultOutcome run_with_fault(DeliberateFault fault, std::uint64_t seed);

/// Not passed is right here: the checks must fail on a core with a fault in it.
[[nodiscard]] CampaignEnd fault_end(const FaultOutcome& outcome, const std::string& fault,
                                    std::uint64_t seed);

}  // namespace haptic::sim
