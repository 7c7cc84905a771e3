// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What the bytes of a core's state are for: where a budget of memory goes.

#include <array>
#include <cstddef>
#include <cstdint>

namespace haptic {

enum class StatePart : std::uint8_t {
  kCore,      ///< the core itself, and rounding to its alignment
  kPairs,     ///< what is kept of each pair, its gate, turned vertices
  kBounds,    ///< bounds of the faces and edges of each pair
  kSearch,    ///< scratch of the search, for the largest pair
  kContacts,  ///< near sets of a tick, patches, hulls
  kOutput,    ///< estimator of the device's twist
  kLaw,       ///< the law's own
  kCount
};

/// Bytes by part.
struct StateAccount {
  std::array<std::size_t, static_cast<std::size_t>(StatePart::kCount)> bytes{};

  [[nodiscard]] std::size_t of(StatePart part) const noexcept {
    return bytes[static_cast<std::size_t>(part)];
  }
  [[nodiscard]] std::size_t total() const noexcept {
    std::size_t sum = 0;
    for (const std::size_t part : bytes) sum += part;
    return sum;
  }
};

}  // namespace haptic
