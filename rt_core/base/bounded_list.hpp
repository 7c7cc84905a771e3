// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A list over memory that somebody else placed: fixed capacity, never grows, tells when it is
/// full.

#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

namespace haptic {

template <typename T>
class BoundedList {
  static_assert(std::is_trivially_destructible_v<T>);

 public:
  BoundedList() = default;
  /// Uses `memory` as storage; empty at first.
  explicit BoundedList(std::span<T> memory) noexcept
      : items_(memory.data()), capacity_(static_cast<std::uint32_t>(memory.size())) {}

  /// Appends; false and unchanged when full.
  [[nodiscard]] bool push(const T& item) noexcept {
    if (size_ == capacity_) return false;
    items_[size_++] = item;
    return true;
  }
  void clear() noexcept { size_ = 0; }
  /// Keeps the first `size` items; `size` must not exceed the present size.
  void truncate(std::uint32_t size) noexcept { size_ = size; }
  [[nodiscard]] std::uint32_t size() const noexcept { return size_; }
  [[nodiscard]] std::uint32_t capacity() const noexcept { return capacity_; }
  [[nodiscard]] bool empty() const noexcept { return size_ == 0; }
  [[nodiscard]] T& operator[](std::uint32_t i) noexcept { return items_[i]; }
  [[nodiscard]] const T& operator[](std::uint32_t i) const noexcept { return items_[i]; }
  [[nodiscard]] T* begin() noexcept { return items_; }
  [[nodiscard]] T* end() noexcept { return items_ + size_; }
  [[nodiscard]] const T* begin() const noexcept { return items_; }
  [[nodiscard]] const T* end() const noexcept { return items_ + size_; }
  [[nodiscard]] std::span<const T> view() const noexcept { return {items_, size_}; }

 private:
  T* items_ = nullptr;
  std::uint32_t size_ = 0;
  std::uint32_t capacity_ = 0;
};

}  // namespace haptic
