// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The thirteen checks of hal/drivers/PROTOCOL.md, section 12, against a device: those that need
/// neither a hand nor an instrument are made, the others are listed for a person. No force is ever
/// asked for: the drives go on, with a wrench of zero.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "tools/run_device/conform_carrier.hpp"

namespace haptic::tools {

enum class ConformResult : std::uint8_t {
  kPassed,
  kFailed,
  kNotDone,  ///< could not be made as the device is: not calibrated, pressed, or failed before
  kByHand,   ///< by a person: `found` says how
  kNotHere   ///< means nothing for this device: no bus, no motors
};

/// "passed", "FAILED", "not done", "by hand", "-".
[[nodiscard]] const char* to_text(ConformResult result) noexcept;

struct ConformCheck {
  int number = 0;  ///< as in section 12
  std::string name;
  ConformResult result = ConformResult::kNotDone;
  std::string found;  ///< figures, or the defect, or what a person has to do
};

struct ConformSettings {
  std::uint32_t reports = 60'000;                 ///< of check 3
  std::function<void(const std::string&)> say{};  ///< progress, for people; may be empty
};

/// Thirteen checks in their order, of a device that is connected; it is disconnected at the end,
/// with the drives off. Every wait is bounded: 0.3 s or 50 periods without a report end it.
[[nodiscard]] std::vector<ConformCheck> check_conformance(ConformCarrier& carrier,
                                                          const ConformSettings& settings);

/// No check failed or was left out for the state of the device.
[[nodiscard]] bool conforms(const std::vector<ConformCheck>& checks) noexcept;

}  // namespace haptic::tools
