// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Writes a recording while a device is used, and never lets it wait: entries go into memory, and a
/// thread of ordinary priority brings them to the file.

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "tools/bridges/record/recording.hpp"

namespace haptic::tools {

struct RecorderSettings {
  std::filesystem::path path;
  std::uint64_t most_bytes = std::uint64_t{256} << 20;  ///< of the file
  std::size_t waiting_bytes = std::size_t{4} << 20;     ///< in memory; a power of two
  /// A line for people, from the recorder's thread: why it has stopped.
  std::function<void(const std::string& line)> say;
};

/// Entries stay in the order in which they were noted. When the file is full, the disk fails or is
/// too slow, the recording ends before the first entry that is lost, and says so once; the device
/// goes on. `note` may be called by any thread; it costs a copy.
class BridgeRecorder final : public hal::DeviceTap {
 public:
  /// Makes the file, for its user alone. A recording that is there is kept as FILE.1.
  /// @throws UsageError  one of the two is there, and is none.
  /// @throws OsError     it cannot be made.
  explicit BridgeRecorder(RecorderSettings settings);
  /// Brings all that was noted to the file.
  ~BridgeRecorder() override;
  BridgeRecorder(const BridgeRecorder&) = delete;
  BridgeRecorder& operator=(const BridgeRecorder&) = delete;

  [[nodiscard]] bool is_replay() const noexcept override { return false; }
  void note(hal::TapKind kind, std::int64_t result, std::span<const std::byte> sent,
            std::span<const std::byte> received) noexcept override;
  [[nodiscard]] std::int64_t give(hal::TapKind, std::span<const std::byte>,
                                  std::span<std::byte>) noexcept override {
    return -1;
  }
  /// It keeps what is noted. False: it has stopped.
  [[nodiscard]] bool is_keeping() const noexcept { return keeps_.load(); }

 private:
  void stop_at(RecordingEnd why) noexcept;
  void copy_in(std::uint64_t& at, std::span<const std::byte> bytes) noexcept;
  void run() noexcept;
  [[nodiscard]] bool take_entries();
  void add(std::size_t bytes);
  void flush();
  void give_up(const std::string& why);
  void finish(RecordingEnd why);

  const RecorderSettings settings_;
  int fd_ = -1;
  // Words of 64 bits. An entry begins with a word of its own, which is not 0 once the rest of it
  // lies there.
  std::vector<std::uint64_t> ring_;
  std::atomic<std::uint64_t> head_{0}, tail_{0};  ///< words since the beginning
  std::atomic<bool> keeps_{true}, is_over_{false};
  std::atomic<RecordingEnd> end_{RecordingEnd::kDone};
  // The thread's.
  std::vector<std::byte> out_;
  std::uint64_t written_ = 0;
  bool has_failed_ = false;
  std::thread thread_;
};

}  // namespace haptic::tools
