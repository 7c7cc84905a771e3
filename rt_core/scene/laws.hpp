// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The laws of force that a scene may name, one row each.

#include <cstdint>
#include <cstring>

namespace haptic {

/// A number is never given to another law.
enum class LawId : std::uint32_t { kPaper = 1, kProxy = 2 };

struct LawRow {
  LawId id;
  const char* name;  ///< in scene files, reports and on command lines
  const char* text;  ///< what the hand feels
};

inline constexpr LawRow kLaws[] = {
    {LawId::kProxy, "proxy", "a felt part that never enters the others, drawn by a spring"},
    {LawId::kPaper, "paper", "force and torque of the depth at the goal, as published"},
};

/// A set of laws: bit of each.
using LawSet = std::uint32_t;
[[nodiscard]] constexpr LawSet law_set(LawId id) noexcept {
  return LawSet{1} << static_cast<std::uint32_t>(id);
}
[[nodiscard]] constexpr LawSet all_laws() noexcept {
  LawSet set = 0;
  for (const LawRow& law : kLaws) set |= law_set(law.id);
  return set;
}

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
