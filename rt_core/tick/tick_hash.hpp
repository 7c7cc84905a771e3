// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The chain of hashes over the results of all ticks.

#include <cstdint>

#include "rt_core/tick/step.hpp"

namespace haptic {

/// Start of the chain.
inline constexpr std::uint64_t kHashStart = 0xcbf29ce484222325ull;

/// The hash after a tick, from the one before. Nothing that a caller may ask for or not is part of
/// it: where the part is `felt` (law kProxy), neither D_near nor the work of the search at the
/// goal.
[[nodiscard]] std::uint64_t chained_hash(std::uint64_t before, const StepResult& result,
                                         bool felt) noexcept;

}  // namespace haptic
