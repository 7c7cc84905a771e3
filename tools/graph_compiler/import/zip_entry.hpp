// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Files out of a ZIP archive in memory.

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace haptic::tools {

struct ZipEntry {
  std::string_view name;          ///< as the archive has it; points into the archive
  std::uint32_t flags = 0;        ///< bit 0: encrypted
  std::uint32_t method = 0;       ///< 0: as it is, 8: deflate
  std::uint32_t check_sum = 0;    ///< CRC-32 of the unpacked bytes
  std::uint64_t packed_size = 0;  ///< [bytes]
  std::uint64_t size = 0;         ///< unpacked [bytes]
  std::uint64_t local_at = 0;     ///< where its local header begins
};

/// The directory of an archive, with the wide sizes of ZIP64 where it has them. Nothing is unpacked
/// until it is asked for.
class ZipArchive {
 public:
  /// @param bytes, file  must outlive the archive; `file` is for messages.
  /// @throws InputError: no archive, cut off, damaged, or in several volumes.
  ZipArchive(std::span<const char> bytes, const std::string& file);

  [[nodiscard]] const std::vector<ZipEntry>& entries() const { return entries_; }
  /// @throws InputError: encrypted, packed by another method than deflate, damaged (the check sum
  /// too), or larger than `limit` bytes.
  [[nodiscard]] std::string unpacked(const ZipEntry& entry, std::size_t limit) const;

 private:
  std::span<const char> bytes_;
  const std::string& file_;
  std::vector<ZipEntry> entries_;
};

/// The first entry whose name ends with `ending` (any case), unpacked.
/// @param file  for messages. @throws InputError: no archive, no such entry, or what `unpacked`
/// refuses.
std::string zip_entry(std::span<const char> archive, std::string_view ending, std::size_t limit,
                      const std::string& file);

}  // namespace haptic::tools
