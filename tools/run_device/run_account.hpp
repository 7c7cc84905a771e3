// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The status and the summary of a run, for people and for programs.

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tools/run_device/device_run.hpp"

namespace haptic::tools {

/// One line, without its end: time, ticks, late ones by degree, link, arming, force, faults.
[[nodiscard]] std::string status_text(const RunStatus& s);
/// `kind`, and which of two devices.
[[nodiscard]] nlohmann::ordered_json line_json(const char* kind, unsigned device);
/// {"kind": "status", ...}
[[nodiscard]] nlohmann::ordered_json status_json(const RunStatus& s);
/// A line for each, and one with the fix.
[[nodiscard]] std::string refusals_text(const std::vector<Refusal>& refusals, bool strict);
/// Several lines.
[[nodiscard]] std::string summary_text(const RunAccount& a);
/// {"kind": "summary", ...}; with one device its keys are among them, of two they are in `devices`.
[[nodiscard]] nlohmann::ordered_json summary_json(const RunAccount& a);

}  // namespace haptic::tools
