// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The file of a recording: what a bridge and its device said to each other, and the poses that
/// were made of it.
///
/// The 16 bytes of kRecordingMagic, then entries, little-endian, until the end of the file:
///
/// | bytes | |
/// |---|---|
/// | u32 | size of the entry, these and the check sum included: kLeastEntry_bytes to
/// kMostEntry_bytes | | u8, 3 x 0 | hal::TapKind | | i64 | CLOCK_MONOTONIC when it was kept [ns] |
/// | i64 | result |
/// | u32, u32 | bytes sent to the device, and received |
/// | | these bytes |
/// | u32 | CRC-32 of all before (hal/drivers/PROTOCOL.md, section 6) |
///
/// The first entry is a kBegin. The last is a kEnd, unless the bridge was killed or its disk full.

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include "hal/bridge/device_tap.hpp"

namespace haptic::tools {

inline constexpr std::string_view kRecordingMagic = "HAPTIC-BRIDGE-R1";
inline constexpr std::size_t kEntryHead_bytes = 32, kLeastEntry_bytes = kEntryHead_bytes + 4;
/// A message of a service has 64 kB at most.
inline constexpr std::size_t kMostEntry_bytes = 96 * 1024;
inline constexpr std::uint64_t kMostRecording_bytes = std::uint64_t{1} << 30;

/// Why a recording ends: result of its kEnd.
enum class RecordingEnd : std::int64_t {
  kDone = 0,  ///< with the bridge
  kFull,      ///< it has the size that it may have
  kSlow,      ///< the disk took entries more slowly than they came
  kTooLong    ///< an entry was larger than kMostEntry_bytes
};

struct RecordEntry {
  hal::TapKind kind = hal::TapKind::kEnd;
  std::int64_t time_ns = 0, result = 0;
  std::vector<std::byte> sent, received;
  std::uint64_t at = 0;  ///< byte of the file at which it begins
};

/// Head of an entry as it stands in a file. @param room  kEntryHead_bytes
void put_entry_head(hal::TapKind kind, std::int64_t time_ns, std::int64_t result, std::size_t sent,
                    std::size_t received, std::span<std::byte> room) noexcept;

/// Reads a recording from the front. Memory: one entry.
class Recording {
 public:
  /// @throws InputError  absent, empty, no recording, of another version, larger than
  ///   kMostRecording_bytes.
  explicit Recording(std::filesystem::path path);

  /// False: the end of the file.
  /// @throws InputError  file, byte and fix, for an entry that is cut short, damaged or impossible.
  [[nodiscard]] bool next(RecordEntry& entry);
  /// "FILE: byte N: ", for who finds a defect in what was read last.
  [[nodiscard]] std::string place() const;

 private:
  [[noreturn]] void refuse(const std::string& defect) const;

  std::filesystem::path path_;
  std::ifstream stream_;
  std::uint64_t size_ = 0, at_ = 0, last_ = 0;
  std::vector<std::byte> bytes_;
};

}  // namespace haptic::tools
