// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Starts device_bridge, which lies beside run_device.

#include <sys/types.h>

#include <filesystem>
#include <string>
#include <vector>

#include "tools/run_device/bridge_answer.hpp"

namespace haptic::tools {

/// @throws OsError  there is none, or it cannot be run.
[[nodiscard]] std::filesystem::path bridge_program();

/// A bridge that was started: what it writes is read from `said`, which does not block.
struct SpawnedBridge {
  pid_t pid = -1;
  int said = -1;
  int error = 0;  ///< errno; then there is neither of the two
};

/// With the rights that this process has, no descriptor of it but the pipe, default signals, and in
/// a group of its own: a Ctrl-C is the session's to follow.
[[nodiscard]] SpawnedBridge spawn_bridge(const std::filesystem::path& program,
                                         std::vector<std::string> words);

/// Lets a bridge open its device once, with its default keys: kLongestProbe_ns at most.
[[nodiscard]] BridgeAnswer probe_bridge(const std::filesystem::path& program,
                                        const std::string& bridge);

inline constexpr std::int64_t kLongestProbe_ns = 5'000'000'000;

}  // namespace haptic::tools
