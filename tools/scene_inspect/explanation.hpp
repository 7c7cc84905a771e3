// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A scene explained to a person on one page: what is in it, what is proved of it, what a tick may
/// cost, what was left out and what that saved, where its memory goes.

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "tools/scene_facts/budget_text.hpp"
#include "tools/scene_inspect/certificates.hpp"

namespace haptic::tools {

/// Facts, and the pruning repeated. Cost: see recheck_pruning.
Inspection inspection_of(const SceneView& view);

/// The page; sentences in lines of at most 100 characters.
std::string explanation(const Inspection& inspection, const BudgetLimits& limits);

/// facts_as_json with `pruning`, `certificates` and `memory`.
nlohmann::ordered_json inspection_as_json(const Inspection& inspection, const BudgetLimits& limits);

}  // namespace haptic::tools
