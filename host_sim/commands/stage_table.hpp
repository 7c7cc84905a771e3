// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The table of an assembly's stages, with the length and the room of each plan, for people and as
/// JSON.

#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace haptic::sim {

/// A stage, and its plan where there is one.
struct StageRow {
  std::size_t number = 0;
  std::string part, how;
  double settled_m = 0;
  double length_m = 0, clearance_m = 0;
  std::uint64_t steps = 0, certified = 0;
  std::string text;     ///< of the plan's file; empty: none
  std::string failure;  ///< empty: found and proved
};

[[nodiscard]] inline std::string in_quotes(const std::string& part) { return "'" + part + "'"; }

/// Prints the table of all stages, or adds it to `json` and prints that. @return exit code: 1 where
/// a stage has no proved plan, and the last line says which.
[[nodiscard]] int say_rows(const std::vector<StageRow>& rows, bool as_json,
                           nlohmann::ordered_json json);

}  // namespace haptic::sim
