// SPDX-License-Identifier: Apache-2.0
#pragma once
/// One file out of a ZIP archive in memory.

#include <span>
#include <string>
#include <string_view>

namespace haptic::tools {

/// The first entry whose name ends with `ending` (any case), unpacked.
/// @param file  for messages. @throws InputError: no archive, no such entry, encrypted, packed by
/// another method than deflate, damaged, or larger than `limit` bytes.
std::string zip_entry(std::span<const char> archive, std::string_view ending, std::size_t limit,
                      const std::string& file);

}  // namespace haptic::tools
