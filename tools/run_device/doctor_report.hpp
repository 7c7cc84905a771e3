// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What the doctor found, for people and for programs.

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "hal/realtime/doctor.hpp"

namespace haptic::tools {

/// Width that prose is wrapped to [columns]. Commands and lines of files are not: they are copied.
inline constexpr std::size_t kReportColumns = 100;

/// A table: name, level, what was found; below it the fix where there is something to fix; the
/// verdict last.
[[nodiscard]] std::string doctor_text(const std::vector<hal::DoctorLine>& lines, bool strict);

/// {"strict", "fit", "lines": [{"name", "level", "refuses_in_strict", "found", "fix"}],
/// "wakeups": null or what was measured, in nanoseconds}.
[[nodiscard]] nlohmann::json doctor_json(const std::vector<hal::DoctorLine>& lines, bool strict,
                                         const hal::WakeupMeasurement* measurement);

}  // namespace haptic::tools
