// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What tests look for in what a program says.

#include <cstddef>
#include <string>

namespace haptic::test {

[[nodiscard]] inline bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

/// How often `part` is there; places may overlap.
[[nodiscard]] inline std::size_t times(const std::string& text, const std::string& part) {
  std::size_t n = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
  return n;
}

}  // namespace haptic::test
