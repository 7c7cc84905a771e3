// SPDX-License-Identifier: Apache-2.0
#pragma once
/// How a scene is coupled to the device and which gains that device bears, as text and as JSON.
/// Shared by scene_inspect and the compiler's report.

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "tools/scene_facts/scene_facts.hpp"

namespace haptic::tools {

/// Gains, limits, lengths of law proxy at this size, stiffness that is left at the largest lever; a
/// few indented lines.
std::string coupling_as_text(const SceneFacts& facts);
nlohmann::ordered_json coupling_as_json(const SceneFacts& facts);

/// One line per contact state; or that no budget was checked, and why.
std::string budget_as_text(const SceneFacts& facts);
/// `{"checked": false, "reason": ...}` where there is none.
nlohmann::ordered_json budget_as_json(const SceneFacts& facts);

/// 2.5e-7 -> "0.25 um"; below a metre in mm or um.
std::string short_length(double length_m);

}  // namespace haptic::tools
