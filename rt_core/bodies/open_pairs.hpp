// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The pairs of bodies that a tick asks, out of all slots for pairs: in the order of the slots, so
/// that sums over them have the same bits whenever the same ones are open.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <span>

#include "rt_core/bodies/body_pair.hpp"

namespace haptic {

/// Pairs that are asked in one tick, at most.
inline constexpr std::uint32_t kMostOpenPairs = 192;

class OpenPairs {
 public:
  /// Visits the pairs themselves.
  template <typename Pair>
  class Iterator {
   public:
    using iterator_category = std::forward_iterator_tag;
    using value_type = BodyPair;
    using difference_type = std::ptrdiff_t;
    using pointer = Pair*;
    using reference = Pair&;
    Iterator() noexcept = default;
    explicit Iterator(BodyPair* const* at) noexcept : at_(at) {}
    [[nodiscard]] Pair& operator*() const noexcept { return **at_; }
    [[nodiscard]] Pair* operator->() const noexcept { return *at_; }
    Iterator& operator++() noexcept {
      ++at_;
      return *this;
    }
    Iterator operator++(int) noexcept { return Iterator(at_++); }
    friend bool operator==(const Iterator&, const Iterator&) noexcept = default;

   private:
    BodyPair* const* at_ = nullptr;
  };

  [[nodiscard]] std::size_t size() const noexcept { return count_; }
  [[nodiscard]] BodyPair& operator[](std::size_t k) noexcept { return *at_[k]; }
  [[nodiscard]] const BodyPair& operator[](std::size_t k) const noexcept { return *at_[k]; }
  [[nodiscard]] Iterator<BodyPair> begin() noexcept { return Iterator<BodyPair>(at_.data()); }
  [[nodiscard]] Iterator<BodyPair> end() noexcept {
    return Iterator<BodyPair>(at_.data() + count_);
  }
  [[nodiscard]] Iterator<const BodyPair> begin() const noexcept {
    return Iterator<const BodyPair>(at_.data());
  }
  [[nodiscard]] Iterator<const BodyPair> end() const noexcept {
    return Iterator<const BodyPair>(at_.data() + count_);
  }

  void clear() noexcept { count_ = 0; }
  /// In the order of the slots, which are one array. False: it is full. O(open pairs).
  [[nodiscard]] bool insert(BodyPair& pair) noexcept {
    if (count_ == at_.size()) return false;
    const auto end = at_.begin() + count_;
    const auto place = std::lower_bound(at_.begin(), end, &pair);
    std::move_backward(place, end, end + 1);
    *place = &pair;
    ++count_;
    return true;
  }
  /// Without effect on one that is not open. O(open pairs).
  void remove(const BodyPair& pair) noexcept {
    const auto end = at_.begin() + count_;
    const auto kept = std::remove(at_.begin(), end, &pair);
    count_ = static_cast<std::uint32_t>(kept - at_.begin());
  }

 private:
  std::array<BodyPair*, kMostOpenPairs> at_{};
  std::uint32_t count_ = 0;
};

}  // namespace haptic
