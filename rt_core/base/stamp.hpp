// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Time stamps: nanoseconds of one monotonic clock with any origin. Differences are taken in
/// integers, so that neither the origin nor the scalar of the build costs resolution.

#include <cstdint>

#include "rt_core/base/scalar.hpp"

namespace haptic {

/// Time from one stamp to another that is not earlier [s]; also across the whole range of stamps.
/// An earlier one gives 0.
[[nodiscard]] inline Real seconds_between(std::int64_t from_ns, std::int64_t to_ns) noexcept {
  if (to_ns <= from_ns) return 0.0_r;
  const std::uint64_t span_ns =
      static_cast<std::uint64_t>(to_ns) - static_cast<std::uint64_t>(from_ns);
  return static_cast<Real>(static_cast<double>(span_ns) * 1.0e-9);
}

}  // namespace haptic
