// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Plays the messages of a recording to the reader of Haply's messages.

#include "tools/bridges/record/replay.hpp"

namespace haptic::tools {

/// @throws InputError of the file.
[[nodiscard]] ReplayResult replay_haply(Recording& recording);

}  // namespace haptic::tools
