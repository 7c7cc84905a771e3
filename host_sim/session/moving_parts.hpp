// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Refuses scenes in which several parts move at once, where a command is about one part that moves
/// among bodies that stand.

#include <string>

#include "host_sim/session/core_session.hpp"

namespace haptic::sim {

/// The parts that move in the same tick as that of the first hand: "part 'socket' is driven, part
/// 'screw' is loose"; empty: there are none.
[[nodiscard]] std::string parts_that_move_too(const CoreSession& session);

/// @param what  the command or option: "wcet".
/// @param fix   what to do instead: "give ..".
/// @throws tools::InputError where other parts move.
void require_one_moving_part(const CoreSession& session, const std::string& scene,
                             const std::string& what, const std::string& fix);

/// The command that judges such a scene, as a fix.
inline constexpr const char* kJudgeBodies =
    "'host_lab bodies-fuzz --scene SCENE' judges and counts their law under random hands";

}  // namespace haptic::sim
