// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Contacts left out of a scene and the saving, as text and as JSON.

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "tools/scene_inspect/certificates.hpp"

namespace haptic::tools {

/// Why contacts could be left out, how many, and bytes and work with and without; some sentences
/// and a small table.
std::string left_out_as_text(const Inspection& inspection);

/// Basic contacts by pair and type (all, reachable, exposed, live), hidden features by piece; the
/// first 20 of each.
std::string pruning_tables_as_text(const Inspection& inspection);

/// All of it.
nlohmann::ordered_json pruning_as_json(const Inspection& inspection);

}  // namespace haptic::tools
