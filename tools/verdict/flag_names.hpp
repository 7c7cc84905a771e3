// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The flags of a tick by name: those of the core (StepFlag), and one that the simulator adds.

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "rt_core/tick/step.hpp"

namespace haptic::tools {

/// Flag of a tick of the literal method, beyond those of the core: no applicable node was left.
inline constexpr std::uint32_t kFlagLocalSetEmpty = kFlagDrivenLost << 1;
inline constexpr std::size_t kFlagCount = 26;
static_assert(kFlagLocalSetEmpty == 1u << (kFlagCount - 1));

/// Name of a bit, e.g. "relocalised".
[[nodiscard]] const char* flag_name(std::size_t bit);
/// Names of all bits that are set, lowest first.
[[nodiscard]] std::vector<std::string> flag_names(std::uint32_t flags);

}  // namespace haptic::tools
