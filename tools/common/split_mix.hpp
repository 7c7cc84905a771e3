// SPDX-License-Identifier: Apache-2.0
#pragma once
/// SplitMix64 (Steele, Lea, Flood 2014): random and scattered words that are the same with every
/// compiler and library.

#include <cstdint>

namespace haptic::tools {

inline constexpr std::uint64_t kSplitMixStep = 0x9e3779b97f4a7c15ull;

/// A bijection after which neighbouring words have nothing in common.
[[nodiscard]] constexpr std::uint64_t mixed(std::uint64_t x) noexcept {
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

/// A hash of `x`: the first word of the generator with this seed.
[[nodiscard]] constexpr std::uint64_t hashed(std::uint64_t x) noexcept {
  return mixed(x + kSplitMixStep);
}

/// In [0, 1), a multiple of 2^-53.
[[nodiscard]] constexpr double unit_interval(std::uint64_t word) noexcept {
  return static_cast<double>(word >> 11) * 0x1.0p-53;
}

class SplitMix64 {
 public:
  explicit constexpr SplitMix64(std::uint64_t seed) noexcept : state_(seed) {}
  constexpr std::uint64_t next() noexcept { return mixed(state_ += kSplitMixStep); }
  constexpr double uniform() noexcept { return unit_interval(next()); }

 private:
  std::uint64_t state_;
};

}  // namespace haptic::tools
