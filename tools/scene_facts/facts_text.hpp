// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Facts about a scene as text for people and as JSON for programs.

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "rt_core/scene/laws.hpp"
#include "tools/scene_facts/scene_facts.hpp"

namespace haptic::tools {

/// Everything, some 40 lines and one per piece and pair (the first 20 of each).
std::string facts_as_text(const SceneFacts& facts);

/// The same facts, complete. Keys in the order of this project, not sorted.
nlohmann::ordered_json facts_as_json(const SceneFacts& facts);

// Parts of them, shared with the compiler's report.
nlohmann::ordered_json pairs_as_json(const SceneFacts& facts);
nlohmann::ordered_json sections_as_json(const SceneFacts& facts);
/// Bounds of one tick, and why some cannot be defended.
nlohmann::ordered_json capacity_as_json(const SceneFacts& facts);
std::string sections_as_text(const SceneFacts& facts);
/// "A 32 (25 .. 25, mean 25.0)" and so on for types A, B, C, one line each.
std::string nodes_as_text(const SceneFacts& facts);

/// One line per pair, the first 20; with the budget of stored graphs where it is known.
std::string pairs_as_text(const SceneFacts& facts, std::optional<std::uint64_t> graph_budget_bytes);

/// "at up to 0.25 m/s and 1 rad/s, late after 0.1 s, pushes with up to 100 N; ..." and the scenes
/// that it has with parts that may be held.
std::string driven_as_text(const DrivenFacts& driven);

/// 1234567 -> "1 234 567".
std::string grouped(std::uint64_t n);

}  // namespace haptic::tools
