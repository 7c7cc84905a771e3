// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Plays the calls of a vendor's library in a recording to the code that made poses of them,
/// without the library.

#include <functional>
#include <memory>

#include "tools/bridges/record/replay.hpp"
#include "tools/bridges/vendor/tapped_handle.hpp"

namespace haptic::tools {

using MakeReplayed = std::function<std::unique_ptr<VendorHandle>(
    const VendorNumbers& settings, std::shared_ptr<hal::DeviceTap> tap)>;

/// Turn by turn of the library's thread. @throws InputError of the file.
[[nodiscard]] ReplayResult replay_turns(Recording& recording, const MakeReplayed& make);

}  // namespace haptic::tools
