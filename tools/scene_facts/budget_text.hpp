// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Memory of a scene as a table: constants by section, state by part, and both against the limits
/// of `[budget]`, where the scene file that holds them is at hand.

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "tools/scene_facts/scene_facts.hpp"

namespace haptic::tools {

/// Limits in bytes; absent: none.
struct BudgetLimits {
  std::string file;  ///< they come from; empty: none was given
  std::optional<std::uint64_t> constants, state, stack;
};

/// "bounds of the search".
const char* state_part_name(StatePart part);

/// Parts of the state, one per line, with their bytes; parts without any are left out.
std::string state_as_text(const SceneFacts& facts);
/// Bytes by part, all parts.
nlohmann::ordered_json state_as_json(const SceneFacts& facts);

/// True when constants and state keep to their limits.
bool within_budget(const SceneFacts& facts, const BudgetLimits& limits);

/// The whole table. The stack is a property of code, compiler and scene together: it is measured
/// where an image is linked, here only its limit is printed.
std::string memory_as_text(const SceneFacts& facts, const BudgetLimits& limits);
nlohmann::ordered_json memory_as_json(const SceneFacts& facts, const BudgetLimits& limits);

}  // namespace haptic::tools
