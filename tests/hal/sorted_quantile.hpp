// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What a histogram of intervals is compared with.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace haptic::hal::test {

inline constexpr double kQuantiles[] = {0.0, 0.001, 0.25, 0.5, 0.9, 0.99, 0.999, 1.0};

/// The least value that at least the share `q` of the ascending `values` keeps.
[[nodiscard]] inline std::int64_t sorted_quantile(const std::vector<std::int64_t>& values,
                                                  double q) {
  const double share = q * static_cast<double>(values.size());
  return values[static_cast<std::size_t>(std::max(std::ceil(share), 1.0)) - 1];
}

}  // namespace haptic::hal::test
