// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Help for people whose device libHD does not open.

#include <string>

#include "tools/bridges/openhaptics/hd_calls.hpp"

namespace haptic::tools {

/// The first number in `version` is 3, or there is none.
[[nodiscard]] bool is_hd_version(const std::string& version) noexcept;

/// Why no device of that name was opened, and what helps: by the error, by GTDD_HOME and by the
/// file of the device that the vendor's set-up program writes there.
[[nodiscard]] std::string hd_open_hint(const HdErrorInfo& error, const std::string& device);

/// The way to calibrate a device, by its style.
[[nodiscard]] std::string hd_calibration_hint(int style);

}  // namespace haptic::tools
