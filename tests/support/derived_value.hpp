// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A value of 256 bytes whose every word follows from one number, so that a torn copy shows.

#include <array>
#include <cstddef>
#include <cstdint>

namespace haptic::test {

/// Number 0 is the value-initialised one.
struct DerivedValue {
  std::array<std::uint64_t, 32> words{};

  static DerivedValue of(std::uint64_t n) {
    DerivedValue v;
    for (std::size_t i = 0; i < v.words.size(); ++i) v.words[i] = word(n, i);
    return v;
  }
  [[nodiscard]] std::uint64_t number() const { return words[0]; }
  [[nodiscard]] bool whole() const {
    for (std::size_t i = 0; i < words.size(); ++i)
      if (words[i] != word(number(), i)) return false;
    return true;
  }

 private:
  // Different in every word, so that words out of place show as well.
  static std::uint64_t word(std::uint64_t n, std::size_t i) { return n * (1 + 2 * i * n); }
};
static_assert(sizeof(DerivedValue) == 256);

}  // namespace haptic::test
