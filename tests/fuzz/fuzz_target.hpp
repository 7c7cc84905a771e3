// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What a fuzz target and its two drivers (libFuzzer, replay_driver.cpp) share.

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

/// The entry point that libFuzzer calls; one per target. Returns 0; throws PropertyBroken, or
/// anything else that the code under test let through, on a finding.
// NOLINTNEXTLINE(readability-identifier-naming): the name is libFuzzer's.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace haptic::fuzz {

/// The code under test accepted an input but broke what its header promises about the result.
class PropertyBroken : public std::logic_error {
 public:
  explicit PropertyBroken(const std::string& text) : std::logic_error(text) {}
};

inline void require(bool holds, const char* property) {
  if (!holds) {
    throw PropertyBroken(property);
  }
}

/// Inputs that the target's code accepts or nearly accepts, from which mutation starts.
struct Seed {
  std::string name;
  std::string bytes;
};
std::vector<Seed> seeds();

}  // namespace haptic::fuzz
