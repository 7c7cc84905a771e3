// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Random numbers that are the same with every compiler and library.

#include <array>
#include <cmath>
#include <cstdint>

namespace haptic::test {

/// SplitMix64.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next() {
    state_ += 0x9e3779b97f4a7c15ull;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    return z ^ (z >> 31);
  }
  /// Uniform in [lo, hi).
  double uniform(double lo, double hi) {
    return lo + (hi - lo) * (static_cast<double>(next() >> 11) * 0x1.0p-53);
  }
  /// Unit quaternion w, x, y, z, uniform over rotations.
  std::array<double, 4> rotation() {
    for (;;) {
      std::array<double, 4> q{};
      double n2 = 0;
      for (double& x : q) {
        x = uniform(-1, 1);
        n2 += x * x;
      }
      if (n2 > 1.0 || n2 < 0.01) continue;
      for (double& x : q) x /= std::sqrt(n2);
      return q;
    }
  }

 private:
  std::uint64_t state_;
};

}  // namespace haptic::test
