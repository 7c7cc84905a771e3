// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A message of the compiler in its parts: "peg.obj:41: face 12 is not flat; split it" is file,
/// place, cause and remedy.

#include <cstdint>
#include <string>
#include <vector>

namespace haptic::tools {

struct MessageRecord {
  std::uint32_t severity = 0;  ///< haptic_severity
  std::string text, file, place, cause, remedy;
};

/// @param files  names that messages may begin with; text before a colon that is none of them
/// belongs to the cause. The remedy is what comes after the last semicolon.
[[nodiscard]] MessageRecord message_record(std::uint32_t severity, const std::string& text,
                                           const std::vector<std::string>& files);

}  // namespace haptic::tools
