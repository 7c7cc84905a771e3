// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Figures by rank over an ascending list, by one definition in all reports.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace haptic::sim {

/// The value at rank `share` (0 to 1) of the way from the least to the largest, the next one above
/// where that lies between two. The list ascends and is not empty.
template <typename Value>
[[nodiscard]] Value quantile(const std::vector<Value>& ascending, double share) {
  const auto last = static_cast<double>(ascending.size() - 1);
  return ascending[static_cast<std::size_t>(std::ceil(share * last))];
}

/// Share of the values above `limit`.
template <typename Value>
[[nodiscard]] double share_over(const std::vector<Value>& ascending, Value limit) {
  const auto above = ascending.end() - std::ranges::upper_bound(ascending, limit);
  return static_cast<double>(above) / static_cast<double>(ascending.size());
}

}  // namespace haptic::sim
