// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Summary of a run, for people and for programs.

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "tools/run_device/device_run.hpp"

namespace haptic::tools {

/// One line, without its end: time, ticks, late ones by degree, link, arming, force, faults.
[[nodiscard]] std::string status_text(const RunStatus& status);
/// {"kind": "status", ...}
[[nodiscard]] nlohmann::ordered_json status_json(const RunStatus& status);

/// A line for each, and one with the fix.
[[nodiscard]] std::string refusals_text(const std::vector<Refusal>& refusals, bool strict);

/// Several lines.
[[nodiscard]] std::string summary_text(const RunAccount& account);
/// {"kind": "summary", ...}
[[nodiscard]] nlohmann::ordered_json summary_json(const RunAccount& account);

}  // namespace haptic::tools
