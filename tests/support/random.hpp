// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Random numbers that are the same with every compiler and library.

#include <array>
#include <cmath>
#include <cstdint>

#include "tools/common/split_mix.hpp"

namespace haptic::test {

class Random {
 public:
  explicit Random(std::uint64_t seed) : words_(seed) {}
  std::uint64_t next() { return words_.next(); }
  /// Uniform in [lo, hi).
  double uniform(double lo, double hi) { return lo + (hi - lo) * words_.uniform(); }
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
  tools::SplitMix64 words_;
};

}  // namespace haptic::test
