// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Defects of a machine, line by line of the doctor.

#include <span>
#include <string>
#include <vector>

#include "hal/realtime/doctor.hpp"
#include "tests/support/fake_machine.hpp"

namespace haptic::test {

inline constexpr auto kPass = hal::DoctorLevel::kPass, kWarning = hal::DoctorLevel::kWarning,
                      kFailure = hal::DoctorLevel::kFailure, kSkipped = hal::DoctorLevel::kSkipped;

/// One change of the healthy machine, and what its line must say then.
struct DoctorCase {
  const char* what;
  const char* line;
  hal::DoctorLevel level;
  bool refuses;
  void (*change)(FakeMachine& m);
  std::vector<std::string> found, fix;
};

[[nodiscard]] std::span<const DoctorCase> kernel_cases();
[[nodiscard]] std::span<const DoctorCase> core_cases();
[[nodiscard]] std::span<const DoctorCase> housekeeping_cases();
[[nodiscard]] std::span<const DoctorCase> power_cases();
[[nodiscard]] std::span<const DoctorCase> usb_cases();
[[nodiscard]] std::span<const DoctorCase> measured_cases();
[[nodiscard]] std::span<const DoctorCase> bridge_cases();

}  // namespace haptic::test
