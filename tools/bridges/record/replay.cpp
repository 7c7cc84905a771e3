// SPDX-License-Identifier: Apache-2.0
#include "tools/bridges/record/replay.hpp"

#include <algorithm>
#include <array>

#include "tools/bridges/record/sample_bytes.hpp"
#include "tools/common/error.hpp"

namespace haptic::tools {

using hal::TapKind;

namespace {

constexpr std::array kCallKinds = {TapKind::kOpen,    TapKind::kOpened, TapKind::kRead,
                                   TapKind::kLooked,  TapKind::kWrite,  TapKind::kClock,
                                   TapKind::kReady,   TapKind::kClose,  TapKind::kRelease,
                                   TapKind::kConnect, TapKind::kSent,   TapKind::kReceived};

/// Entries whose result is a time.
constexpr std::array kTimeKinds = {TapKind::kClock, TapKind::kRead, TapKind::kWrite,
                                   TapKind::kRelease};
constexpr std::int64_t kLatest_ns = std::int64_t{1} << 61;
/// By which time goes on at each look once a replay is over.
constexpr std::int64_t kStep_ns = 1'000'000;

/// A device that a recording is played to, until here: also where its file is damaged.
class TappedDevice {
 public:
  TappedDevice(hal::BridgedDevice& device, ReplayTap& tap) : device_(device) {
    device_.set_tap(tap.shared());
  }
  ~TappedDevice() {
    device_.close();
    device_.set_tap(nullptr);
  }
  TappedDevice(const TappedDevice&) = delete;
  TappedDevice& operator=(const TappedDevice&) = delete;

 private:
  hal::BridgedDevice& device_;
};

std::string number_of(TapKind kind) {
  return "entry of kind " + std::to_string(static_cast<int>(kind));
}

}  // namespace

ReplayTap::ReplayTap(Recording& recording, std::span<const TapKind> kinds)
    : recording_(recording), kinds_(kinds.begin(), kinds.end()) {}

void ReplayTap::diverge(const std::string& how) {
  if (result_.first.empty()) result_.first = recording_.place() + how;
}

bool ReplayTap::fetch() noexcept {
  if (!result_.first.empty() || !defect_.empty()) return false;
  try {
    while (recording_.next(entry_)) {
      const bool is_time = std::ranges::find(kTimeKinds, entry_.kind) != kTimeKinds.end();
      if (is_time && (entry_.result < 0 || entry_.result > kLatest_ns)) {
        diverge("a time of " + std::to_string(entry_.result) + " ns cannot be");
        return false;
      }
      if (is_time) clock_ns_ = std::max(clock_ns_, entry_.result);
      if (entry_.kind == TapKind::kEnd) {
        result_.has_end = true;
        result_.end = static_cast<RecordingEnd>(entry_.result);
      }
      if (std::ranges::find(kinds_, entry_.kind) != kinds_.end()) return true;
    }
  } catch (const InputError& error) {
    defect_ = error.what();
  }
  return false;
}

const RecordEntry* ReplayTap::next() {
  const bool is_there = fetch();
  if (!defect_.empty()) throw InputError(defect_);
  return is_there ? &entry_ : nullptr;
}

std::int64_t ReplayTap::give(TapKind kind, std::span<const std::byte> sent,
                             std::span<std::byte> room) noexcept {
  // A replay that is over says no bytes any more, and its time goes on, so that each wait ends.
  const bool is_there = fetch();
  const std::int64_t over = kind == TapKind::kClock ? clock_ns_ + kStep_ns : -1;
  if (!is_there) {
    if (kind == TapKind::kClock) clock_ns_ += kStep_ns;
    return over;
  }
  if (entry_.kind != kind) {
    diverge("the bridge goes another way here: " + number_of(kind) + " instead of " +
            std::to_string(static_cast<int>(entry_.kind)));
    return over;
  }
  if (!std::ranges::equal(sent, entry_.sent)) {
    diverge("the bridge says something else to the device here");
    return over;
  }
  if (entry_.received.size() > room.size() ||
      (kind == TapKind::kCall && entry_.received.size() != room.size()) ||
      (kind == TapKind::kReceived && std::max<std::int64_t>(entry_.result, 0) !=
                                         static_cast<std::int64_t>(entry_.received.size()))) {
    diverge("the bridge takes less here than the device has said");
    return -1;
  }
  std::ranges::copy(entry_.received, room.begin());
  return entry_.result;
}

void ReplayTap::compare(std::span<const std::byte> pose, std::span<const std::byte> recorded) {
  ++result_.poses;
  if (std::ranges::equal(pose, recorded)) return;
  ++result_.different;
  diverge("another pose than then");
}

void ReplayTap::expect(TapKind kind, std::int64_t result, std::span<const std::byte> same_as) {
  if (!fetch()) return;
  if (entry_.kind != kind) return diverge("the bridge asks its device for less here than then");
  if (entry_.result != result)
    return diverge("another outcome than then: " + std::to_string(result) + " instead of " +
                   std::to_string(entry_.result));
  if (!same_as.empty()) compare(same_as, entry_.received);
}

ReplayResult replay_calls(Recording& recording, hal::BridgedDevice& device) {
  ReplayTap tap(recording, kCallKinds);
  const TappedDevice tapped(device, tap);
  hal::BridgeSample sample;
  std::string why;
  while (const RecordEntry* const entry = tap.next()) {
    const std::int64_t at_ns = entry->result;
    switch (entry->kind) {
      case TapKind::kOpen: {
        const bool is_open = device.open(why);
        tap.expect(TapKind::kOpened, is_open ? 1 : 0, {});
        break;
      }
      case TapKind::kRead: {
        const hal::BridgeRead read = device.read(at_ns, sample);
        const SampleBytes bytes = bytes_of(sample);
        tap.expect(TapKind::kLooked, static_cast<std::int64_t>(read),
                   std::span(bytes).first(read == hal::BridgeRead::kNew ? bytes.size() : 0));
        break;
      }
      case TapKind::kWrite:
        (void)device.write(at_ns, wrench_of_bytes(entry->sent));
        break;
      case TapKind::kRelease:
        (void)device.release(at_ns);
        break;
      case TapKind::kClose:
        device.close();
        break;
      default:
        tap.diverge("the bridge asks its device for less here than then");
    }
  }
  device.close();  // with the result's last word, which a closing may still change
  return tap.result();
}

}  // namespace haptic::tools
