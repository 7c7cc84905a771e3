// SPDX-License-Identifier: Apache-2.0
#pragma once
/// `host_sim run` of a scene with two hands, each with its device and its motion.

#include "host_sim/commands/run_account.hpp"
#include "host_sim/commands/run_arguments.hpp"

namespace haptic::sim {

/// @return whether it has passed. @throws tools::UsageError for arguments that are for one hand;
/// tools::InputError as the readers of the scripts.
bool run_two_hands(const RunArguments& o, CoreSession& session, const RunSubject& subject,
                   const HandModel& hand);

}  // namespace haptic::sim
