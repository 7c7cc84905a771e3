// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The line by which a bridge answers `--probe --json` (tools/bridges/facts_text.hpp), read by who
/// has started it. A bridge may have closed code in it: nothing of the line is trusted.

#include <cstddef>
#include <string>
#include <string_view>

namespace haptic::tools {

/// Bytes of a line, and so of each text in it.
inline constexpr std::size_t kMostBridgeAnswer = 64 * 1024;

/// Answer of a bridge that was to look for its device, for `run_device list`.
struct BridgeAnswer {
  bool found = false;
  std::string name, words;      ///< of a device that was found
  std::string needs;            ///< of these: what its owner has to do before it can be used
  std::string product, serial;  ///< as it states them itself
  double latency_ms = 0;
  bool has_force = false;                         ///< it drives a degree of freedom
  double max_stiffness_n_per_m = 0, mass_kg = 0;  ///< 0: it does not state it
  std::string why;                                ///< else, and never empty then
};

/// A line that is no answer is the reason, as a program that fails says it.
[[nodiscard]] BridgeAnswer read_bridge_answer(std::string_view line);

}  // namespace haptic::tools
