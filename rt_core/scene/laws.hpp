// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The laws of force that a scene may name, one row each.

#include <cstring>

#include "rt_core/scene/scene_format.hpp"

namespace haptic {

struct LawRow {
  LawId id;
  const char* name;  ///< in scene files, reports and on command lines
  const char* text;  ///< what the hand feels
};

inline constexpr LawRow kLaws[] = {
    {LawId::kProxy, "proxy", "a felt part that never enters the others, drawn by a spring"},
    {LawId::kPaper, "paper", "force and torque of the depth at the goal, as published"},
};

[[nodiscard]] constexpr const LawRow* find_law(LawId id) noexcept {
  for (const LawRow& law : kLaws) {
    if (law.id == id) return &law;
  }
  return nullptr;
}

/// `id` must be one of kLaws.
[[nodiscard]] constexpr const char* law_name(LawId id) noexcept { return find_law(id)->name; }

/// Null: no law has the name.
[[nodiscard]] inline const LawRow* find_law(const char* name) noexcept {
  for (const LawRow& law : kLaws) {
    if (std::strcmp(law.name, name) == 0) return &law;
  }
  return nullptr;
}

}  // namespace haptic
