// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The three types of basic contacts (paper Sec. II-A), and which of them an image compiles.

#include <cstdint>

#include "rt_core/scene/scene_traits.hpp"

namespace haptic {

enum class ContactType : std::uint8_t { kA, kB, kC };

/// Whether basic contacts of a type are compiled.
[[nodiscard]] constexpr bool has_type(ContactType type) noexcept {
  return type == ContactType::kA   ? kSceneTraits.type_a
         : type == ContactType::kB ? kSceneTraits.type_b
                                   : kSceneTraits.type_c;
}

/// The type itself, which is one that is compiled; said so that the compiler drops the others.
[[nodiscard]] constexpr ContactType compiled_type(ContactType type) noexcept {
  constexpr ContactType kSome = kSceneTraits.type_b   ? ContactType::kB
                                : kSceneTraits.type_a ? ContactType::kA
                                                      : ContactType::kC;
  constexpr int kCount = int{kSceneTraits.type_a} + kSceneTraits.type_b + kSceneTraits.type_c;
  return kCount > 1 && has_type(type) ? type : kSome;
}

}  // namespace haptic
