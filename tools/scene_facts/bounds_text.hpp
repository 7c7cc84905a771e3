// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The bounds of one tick of a scene in words, and why some of them cannot be defended. Work is
/// bounded in every case; what cannot be defended is that no tick ever has to give up exactness for
/// it.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tools/scene_facts/scene_facts.hpp"

namespace haptic::tools {

/// "piece 2 of 'hull.stl'"; `piece` counts over the whole scene.
std::string piece_name(const SceneFacts& facts, std::uint32_t piece);

/// "pair 3 (piece 0 of 'peg.stl', piece 2 of 'hull.stl')".
std::string pair_name(const SceneFacts& facts, std::size_t pair);

/// How a pair's graph is held and why: "stored, 41 kB"; "formed on the fly: stored it would take 67
/// MB". With a budget, given where it is known, its size is said too.
std::string graph_form(const PairFacts& pair, std::optional<std::uint64_t> graph_budget_bytes);

/// One sentence for every bound that cannot be defended, with names, numbers and a fix; empty when
/// the scene can be certified. Agrees with SceneCapacity::unproven.
std::vector<std::string> unproven_reasons(const SceneFacts& facts);

/// State, bounds of one tick and the verdict on them, a few indented lines; reasons beyond the
/// first 20 are counted.
std::string bounds_as_text(const SceneFacts& facts);

/// 41234 -> "41 kB", 67000000 -> "67 MB".
std::string short_bytes(std::uint64_t bytes);

}  // namespace haptic::tools
