// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Counts of the ticks of a case as figures of a study.

#include <cstdint>
#include <string>
#include <vector>

#include "host_sim/lab/bodies_study/bodies_study.hpp"
#include "host_sim/lab/wcet/instruction_counts.hpp"

namespace haptic::sim {

// In full: by a part of its name callgrind counts a function, but does not end a tick with it.
inline constexpr const char* kLawOfOne =
    "haptic::Proxy::tick(haptic::GripPose const&, haptic::NearScratch&)";
inline constexpr const char* kLawOfSeveral =
    "haptic::BodyLaw::tick(std::span<haptic::GripPose const, 18446744073709551615ul>)";

using TickCounts = std::vector<std::uint64_t>;

/// Those of the ticks in which the bodies are pressed, ascending.
[[nodiscard]] TickCounts pressed_counts(const TickCounts& ticks);
/// Mean, 99 % and largest; not a number where nothing was measured.
void add_spread(StudyRow& row, const std::string& name, const std::string& words,
                const TickCounts& ascending);
/// Those of the pressed ticks, ascending; empty, with the reason on standard error, where they
/// cannot be counted. `name`: of the case.
[[nodiscard]] TickCounts pressed_instructions(const std::string& name,
                                              const InstructionQuestion& question);

}  // namespace haptic::sim
