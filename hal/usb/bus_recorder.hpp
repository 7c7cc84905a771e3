// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Records a session while it runs: the USB thread and the servo thread each push into a ring of
/// their own, which never makes them wait; an ordinary thread, or the caller between two steps,
/// writes the file.

#include <array>
#include <atomic>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "hal/usb/bus_record.hpp"
#include "rt_core/exchange/spsc_ring.hpp"

namespace haptic::hal {

enum class RecorderDrain : std::uint8_t {
  kThread = 0,  ///< by a thread of its own, every few milliseconds
  kCaller       ///< by `drain`: everything runs in one thread
};

/// How a recording ended.
struct RecorderEnd {
  HalStatus status = HalStatus::kOk;  ///< kOsRefused: the file could not be written
  int os_error = 0;                   ///< errno then
  RecordEnd counts;
  [[nodiscard]] bool playable() const noexcept {
    return status == HalStatus::kOk && counts.dropped_events + counts.dropped_ticks == 0;
  }
};

/// Begins with the link's first poll and the servo loop's first tick; after an orderly end of the
/// link nothing more of it is recorded. Bounded memory: two rings, about 4 MB. The file grows
/// next to its name (.part) and takes it in `finish`; what was written before a crash can be read
/// up to its last whole record.
class BusRecorder final : public LinkTape {
 public:
  BusRecorder(const std::string& path, const BusSession& session, RecorderDrain drain);
  /// Without `finish` before: the .part stays.
  ~BusRecorder() override;
  BusRecorder(const BusRecorder&) = delete;
  BusRecorder& operator=(const BusRecorder&) = delete;

  /// Before the first tick: the hand of a scene with parts, whose calls are recorded too. It
  /// outlives the ticks.
  void follow(const PartHand& hand) noexcept { hand_ = &hand; }

  /// A TickWatch; `self` is the recorder. Servo thread: a push for the tick and for each pose and
  /// call that was given for it, no system call.
  static void watch(void* self, const ServoInput& input, const ServoResult& result);

  // USB thread: pushes, no system call.
  void on_event(const LinkEvent& event) noexcept override;
  void on_state(const DeviceState& /*state*/) noexcept override {}

  /// kCaller: writes what has come. False when the file cannot be written.
  bool drain();

  /// Once neither thread calls any more: the rest, the counts, and the file's name. Again: the
  /// same.
  RecorderEnd finish();

 private:
  struct Event {
    LinkEventKind kind = LinkEventKind::kTurn;
    std::uint8_t code = 0, why = 0;
    std::uint16_t size = 0;
    std::int64_t stamp_ns = 0;
    std::uint64_t number = 0;
    std::array<std::uint8_t, kMostEventBytes> bytes;
  };
  /// A tick, or what was given before it.
  struct ServoEntry {
    bool is_tick = true;
    RecordedTick tick;
    RecordedGiven given;
  };
  struct Rings {
    SpscRing<Event, 4096> events;
    SpscRing<ServoEntry, 4096> ticks;
  };

  void push_given(const ServoInput& input) noexcept;
  void push_frame(std::uint32_t number, const FrameRecord& frame) noexcept;
  void push_clocks() noexcept;
  void run();
  void write();
  void put_event(const Event& event);

  const std::string path_, part_;
  std::unique_ptr<Rings> rings_;
  // Servo thread.
  const PartHand* hand_ = nullptr;
  PartHand::Phase stepped_as_ = PartHand::Phase::kHolding;
  std::array<std::uint64_t, kMostDriven + 1> frame_numbers_{};
  // USB thread.
  std::array<std::int64_t, kMostClocks> clocks_{};
  std::size_t clock_count_ = 0;
  bool closed_ = false;
  std::atomic<std::uint64_t> too_long_{0};  ///< events with more bytes than are kept
  // Whoever drains.
  std::FILE* file_ = nullptr;
  std::vector<std::uint8_t> bytes_;
  Event event_;
  std::uint64_t records_ = 0;
  int os_error_ = 0;
  bool finished_ = false;
  RecorderEnd end_;
  std::thread thread_;
  std::atomic<bool> stop_{false};
};

}  // namespace haptic::hal
