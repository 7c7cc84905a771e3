// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Lays arrays out in caller-supplied memory, once, before the loop starts. The same sequence of
/// calls with no memory only counts, so the size that a scene's header states and the layout cannot
/// disagree.

#include <cstddef>
#include <cstdint>
#include <new>
#include <span>
#include <type_traits>

#include "rt_core/base/state_account.hpp"

namespace haptic {

class Arena {
 public:
  /// Counts only.
  Arena() = default;
  /// Counts, and enters what is taken into `account`, which must outlive the arena.
  explicit Arena(StateAccount& account) noexcept : account_(&account) {}
  /// Places objects from `memory` on; the caller has checked that it is large enough and aligned.
  explicit Arena(std::byte* memory) noexcept : memory_(memory) {}

  /// `count` default-constructed objects; empty when counting.
  template <typename T>
  [[nodiscard]] std::span<T> take(std::size_t count) noexcept {
    static_assert(std::is_trivially_destructible_v<T>);
    const std::size_t before = used_;
    used_ = (used_ + alignof(T) - 1) / alignof(T) * alignof(T);
    const std::size_t at = used_;
    used_ += count * sizeof(T);
    if (account_ != nullptr) account_->bytes[static_cast<std::size_t>(part_)] += used_ - before;
    if (memory_ == nullptr) return {};
    T* const first = reinterpret_cast<T*>(memory_ + at);
    for (std::size_t k = 0; k < count; ++k)
      ::new (static_cast<void*>(first + k)) T();  // placement, no heap
    return {first, count};
  }
  [[nodiscard]] std::size_t used() const noexcept { return used_; }
  /// From now on `part` is charged.
  void enter(StatePart part) noexcept { part_ = part; }

 private:
  std::byte* memory_ = nullptr;
  std::size_t used_ = 0;
  StateAccount* account_ = nullptr;
  StatePart part_ = StatePart::kCore;
};

}  // namespace haptic
