// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Plays a recording to the code that made poses of it, and compares its poses with those that it
/// made then, to the bit. Nothing of a device, a service or a library is needed.

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "hal/bridge/bridged_device.hpp"
#include "tools/bridges/record/recording.hpp"

namespace haptic::tools {

struct ReplayResult {
  std::uint64_t poses = 0;      ///< that were compared
  std::uint64_t different = 0;  ///< of those
  /// The first difference, or where the code of today asks its device for something else than the
  /// code of then: file, byte, defect. Empty: none.
  std::string first;
  RecordingEnd end = RecordingEnd::kDone;
  bool has_end = false;  ///< false: the bridge was killed, or its disk full
};

/// Says the entries of a recording instead of a device. Entries of other kinds than `kinds` are
/// left out.
/// It is what drives the replay too: it takes the entries that are the bridge's.
class ReplayTap final : public hal::DeviceTap {
 public:
  ReplayTap(Recording& recording, std::span<const hal::TapKind> kinds);

  [[nodiscard]] bool is_replay() const noexcept override { return true; }
  void note(hal::TapKind, std::int64_t, std::span<const std::byte>,
            std::span<const std::byte>) noexcept override {}
  [[nodiscard]] std::int64_t give(hal::TapKind kind, std::span<const std::byte> sent,
                                  std::span<std::byte> room) noexcept override;

  /// The next entry, for who drives the replay; null: the end, or `result().first` says why not.
  [[nodiscard]] const RecordEntry* next();
  /// The entry that must follow; `same_as`: with these bytes received, which are a pose.
  void expect(hal::TapKind kind, std::int64_t result, std::span<const std::byte> same_as);
  /// A pose by today's code beside that of the entry taken last.
  void compare(std::span<const std::byte> pose, std::span<const std::byte> recorded);
  [[nodiscard]] const ReplayResult& result() const noexcept { return result_; }
  void diverge(const std::string& how);
  /// This, as devices hold a tap; it must outlive them.
  [[nodiscard]] std::shared_ptr<hal::DeviceTap> shared() {
    return {this, [](hal::DeviceTap*) {}};
  }

 private:
  [[nodiscard]] bool fetch() noexcept;

  Recording& recording_;
  std::vector<hal::TapKind> kinds_;
  RecordEntry entry_;
  std::int64_t clock_ns_ = 0;  ///< the latest time of the recording so far
  ReplayResult result_;
  std::string defect_;  ///< of the file, to be thrown where that may be done
};

/// A device that does all on the bridge's thread, call by call. @throws InputError of the file.
[[nodiscard]] ReplayResult replay_calls(Recording& recording, hal::BridgedDevice& device);

}  // namespace haptic::tools
