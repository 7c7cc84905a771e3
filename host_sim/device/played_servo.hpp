// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The servo thread of a recorded session: its ticks in their order, each once the state that it
/// saw has been published.

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hal/usb/bus_record.hpp"
#include "host_sim/session/core_session.hpp"

namespace haptic::sim {

// The two tracks of a recorded session, each in its own order: the link's events, one clock value
// at a time, and the servo ticks; and how they read in a message.

/// Where a track is in its file.
struct TrackPlace {
  std::uint64_t record = 0, offset = 0;
};

/// A servo tick of a recorded session that was equal: what it saw and made, and by which
/// parameters.
using PlayWatch =
    std::function<void(const ServoParameters&, const ServoInput&, const ServoResult&)>;

/// Over a file that was checked before and outlives it. Copied to look ahead.
class EventTrack {
 public:
  EventTrack(std::span<const std::uint8_t> file, std::size_t first) : reader_(file, first) {
    advance();
  }

  /// False once all events were taken.
  [[nodiscard]] bool has_next() const { return has_next_; }
  [[nodiscard]] const hal::LinkEvent& next() const { return event_; }
  [[nodiscard]] TrackPlace place() const { return {record_.number, record_.offset}; }
  [[nodiscard]] bool next_is(hal::LinkEventKind kind) const {
    return has_next_ && event_.kind == kind;
  }
  void advance();

  /// First event, from the next one to the end of the turn, for which `wanted` holds.
  template <typename Wanted>
  [[nodiscard]] std::optional<hal::LinkEvent> in_this_turn(Wanted wanted) const {
    for (EventTrack ahead = *this; ahead.has_next_; ahead.advance()) {
      if (wanted(ahead.event_)) return ahead.event_;
      if (ahead.event_.kind == hal::LinkEventKind::kTurn ||
          ahead.event_.kind == hal::LinkEventKind::kClose)
        return std::nullopt;
    }
    return std::nullopt;
  }

 private:
  hal::BusRecordReader reader_;
  hal::BusRecord record_;
  std::size_t clock_ = 0, clocks_ = 0;  ///< within a record of clock values
  hal::LinkEvent event_;
  bool has_next_ = false;
};

class TickTrack {
 public:
  TickTrack(std::span<const std::uint8_t> file, std::size_t first) : reader_(file, first) {
    advance();
  }
  [[nodiscard]] bool has_next() const { return has_next_; }
  [[nodiscard]] const hal::RecordedTick& next() const { return tick_; }
  /// Before it, since the last one.
  [[nodiscard]] std::span<const hal::RecordedGiven> given() const { return given_; }
  [[nodiscard]] TrackPlace place() const { return {record_.number, record_.offset}; }
  void advance();

 private:
  hal::BusRecordReader reader_;
  hal::BusRecord record_;
  hal::RecordedTick tick_;
  std::vector<hal::RecordedGiven> given_;
  bool has_next_ = false;
};

/// "report, verdict state, number 17, at 1.000000000 s, 96 bytes".
[[nodiscard]] std::string text_of(const hal::LinkEvent& event);
/// How the second differs from the first, one line per bytes or number.
[[nodiscard]] std::string difference(const hal::LinkEvent& expected, const hal::LinkEvent& found);
[[nodiscard]] std::string difference(const hal::RecordedTick& expected,
                                     const hal::RecordedTick& found);
/// Bytes of the reports that gave states `sequence` - 1 to `sequence` + 1, with their records.
[[nodiscard]] std::string reports_around(std::span<const std::uint8_t> file, std::size_t first,
                                         std::uint64_t sequence);

/// Owner: one thread; session and file outlive it.
class PlayedServo {
 public:
  PlayedServo(CoreSession& session, const hal::BusSession& header,
              std::span<const std::uint8_t> file, std::size_t first, PlayWatch watch);

  /// The link published it.
  void publish(const haptic::DeviceState& state) { states_.push_back(state); }

  /// Runs ticks until one lacks its state, differs, or is far ahead of the link.
  void run();
  /// Runs ticks until the command of this tick and stamp is there; null: it cannot be had. Those
  /// before it are forgotten.
  const DeviceCommand* command(std::uint64_t tick, std::int64_t stamp_ns);
  /// Runs what is left, as far as it goes.
  void run_to_end();

  /// At the next tick.
  [[nodiscard]] const TickTrack& track() const { return track_; }
  [[nodiscard]] std::uint64_t ticks() const { return ticks_; }  ///< that were equal
  /// How the tick at track() differed from what was recorded; empty: it did not.
  [[nodiscard]] const std::string& difference_found() const { return difference_; }
  [[nodiscard]] const haptic::DeviceState& newest_state() const { return states_.back(); }

 private:
  void restart();
  bool step();
  /// False: the hand cannot take that part, or the scene has none.
  bool give(const hal::RecordedGiven& given);

  CoreSession& session_;
  ServoParameters parameters_;
  TickTrack track_;
  PlayWatch watch_;
  std::unique_ptr<ServoTick> tick_;
  FrameRecord frame_;  ///< newest of the fixed parts
  std::array<FrameRecord, kMostDriven> driven_;
  std::deque<haptic::DeviceState> states_;  ///< published, from the one last seen on
  std::deque<DeviceCommand> commands_;      ///< made, from the one last taken on
  std::string difference_;
  std::uint64_t ticks_ = 0;
};

}  // namespace haptic::sim
