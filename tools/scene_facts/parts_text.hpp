// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The parts of a scene in words: their roles, which may touch, what their law needs and may do.

#include <string>

#include "tools/scene_facts/scene_facts.hpp"

namespace haptic::tools {

/// "driven".
[[nodiscard]] const char* role_name(PartRole role);

/// Some indented lines; empty for a scene in which one part alone moves. Pairs beyond the first 20
/// are counted.
[[nodiscard]] std::string parts_as_text(const SceneFacts& facts);

}  // namespace haptic::tools
