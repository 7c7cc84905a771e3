// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The examples of hal/drivers/PROTOCOL.md, as they stand there.

#include <doctest/doctest.h>

#include <cstdint>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace haptic::hal::test {

/// Text of the block that "```info" opens.
inline std::string fenced(const std::string& info) {
  std::ifstream file(HAPTIC_TEST_DIR "/../hal/drivers/PROTOCOL.md");
  REQUIRE(file.good());
  std::string line;
  while (std::getline(file, line) && line != "```" + info) {
  }
  std::string text;
  while (std::getline(file, line) && line != "```") text += line + '\n';
  REQUIRE_FALSE(text.empty());
  return text;
}

inline std::vector<std::uint8_t> bytes_in(const std::string& info) {
  std::istringstream stream(fenced(info));
  std::vector<std::uint8_t> bytes;
  for (unsigned byte = 0; stream >> std::hex >> byte;) {
    REQUIRE(byte <= 0xff);
    bytes.push_back(static_cast<std::uint8_t>(byte));
  }
  REQUIRE(stream.eof());
  return bytes;
}

}  // namespace haptic::hal::test
