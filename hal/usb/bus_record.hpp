// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The file of a recorded session (.hrec): what it was made with, then every event of the link
/// (link_tape.hpp) and every servo tick, each with its own check sum. Layout: RECORD.md.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "hal/usb/link_tape.hpp"
#include "hal/usb/usb_link.hpp"
#include "rt_core/servo_tick.hpp"

namespace haptic::hal {

/// The inputs of a session apart from its tape.
struct BusSession {
  std::uint64_t scene_hash = 0;  ///< content hash of the scene
  std::string driver;            ///< UsbProfile::name, at most kMostDriverName bytes
  std::uint16_t vendor_id = 0, product_id = 0;
  std::int64_t period_ns = 1'000'000;
  bool report_clocked = false;
  ServoParameters servo;
  /// Limits, numbers and times are recorded; address and clock are not.
  LinkSettings link;
};
inline constexpr std::size_t kMostDriverName = 128;

/// One servo tick: what it was given and what it made. Of the state, what tells it from the others
/// that the link published; pose, twist and switches follow from the report and are only hashed.
struct RecordedTick {
  std::uint64_t tick = 0;
  std::int64_t now_ns = 0;
  std::uint32_t late_periods = 0;
  bool emergency_stop = false;
  std::uint64_t sequence = 0;
  std::int64_t stamp_ns = 0;
  std::uint8_t link = 0;
  bool twist_valid = false;
  std::uint32_t device_faults = 0;
  std::uint64_t state_content = 0;  ///< FNV-1a of pose, twist, switches
  std::uint64_t accepted_tick = 0;
  std::array<double, 6> accepted_d{};  ///< force [N], torque [N m]
  std::uint64_t state_hash = 0;
  std::array<double, 6> command_d{};
  std::uint64_t command_sequence = 0;
  std::uint32_t arming = 0, faults = 0, limiter_flags = 0;
  std::uint8_t arming_state = 0;
};

[[nodiscard]] RecordedTick recorded(const ServoInput& input, const ServoResult& result) noexcept;

/// A servo tick of a scene with parts is given more by its owner: a pose of the fixed parts' frame
/// or of a driven part; or that the hand lets go, or takes a part.
struct RecordedGiven {
  enum class Kind : std::uint8_t { kFrame = 34, kRelease = 35, kTake = 36 };
  Kind kind = Kind::kFrame;
  /// kFrame: 0 of the fixed parts, k + 1 of driven part k; kTake: the part; else 0.
  std::uint32_t number = 0;
  FrameRecord frame;  ///< of kFrame
};

/// Last record of a session that was ended in order.
struct RecordEnd {
  std::uint64_t records = 0;         ///< before this one
  std::uint64_t dropped_events = 0;  ///< any drop: cannot be played
  std::uint64_t dropped_ticks = 0;
};

// Writing: bytes are appended.
void append_header(std::vector<std::uint8_t>& file, const BusSession& session);
/// Not for kClock. At most kMostEventBytes of `bytes` are kept.
void append_event(std::vector<std::uint8_t>& file, const LinkEvent& event);
/// At most kMostClocks values.
void append_clocks(std::vector<std::uint8_t>& file, std::span<const std::int64_t> stamps_ns);
void append_tick(std::vector<std::uint8_t>& file, const RecordedTick& tick);
/// Before the tick that it was given for.
void append_given(std::vector<std::uint8_t>& file, const RecordedGiven& given);
void append_end(std::vector<std::uint8_t>& file, const RecordEnd& end);

inline constexpr std::size_t kMostEventBytes = 512;
inline constexpr std::size_t kMostClocks = 64;

/// Where a file is not what it should be.
struct RecordDefect {
  std::uint64_t record = 0;  ///< number of the record, from 1 on; 0: the header
  std::uint64_t offset = 0;  ///< of its first byte in the file
  bool cut = false;          ///< the file ends within it, all before is whole
  std::string text;          ///< empty: no defect
};

/// Reads the header. @return the defect, if any; else `first` is where the records begin.
[[nodiscard]] RecordDefect read_header(std::span<const std::uint8_t> file, BusSession& session,
                                       std::size_t& first);

inline constexpr std::uint8_t kTickRecord = 32, kEndRecord = 33;

/// One record as it lies in the file.
struct BusRecord {
  std::uint64_t number = 0, offset = 0;
  std::uint8_t kind = 0;  ///< LinkEventKind, RecordedGiven::Kind, kTickRecord or kEndRecord
  std::span<const std::uint8_t> payload;

  [[nodiscard]] bool is_event() const noexcept { return kind <= kMostLinkEventKind; }
  [[nodiscard]] bool is_given() const noexcept {
    return kind >= static_cast<std::uint8_t>(RecordedGiven::Kind::kFrame) &&
           kind <= static_cast<std::uint8_t>(RecordedGiven::Kind::kTake);
  }
};

/// Goes through the records of a file that outlives it. With any bytes, nothing outside
/// them is touched. Cost of a record: one pass over its bytes.
class BusRecordReader {
 public:
  BusRecordReader(std::span<const std::uint8_t> file, std::size_t first) noexcept
      : file_(file), at_(first) {}

  /// False at the end of the file, and at a defect, where it stays.
  [[nodiscard]] bool next(BusRecord& record);
  [[nodiscard]] const RecordDefect& defect() const noexcept { return defect_; }

 private:
  bool refuse(std::string text, bool cut = false);

  std::span<const std::uint8_t> file_;
  std::size_t at_;
  std::uint64_t number_ = 0;
  RecordDefect defect_;
};

// For records that BusRecordReader has given, whose payloads it has checked.
[[nodiscard]] LinkEvent event_of(const BusRecord& record) noexcept;  ///< not kClock
[[nodiscard]] std::size_t clock_count(const BusRecord& record) noexcept;
[[nodiscard]] std::int64_t clock_of(const BusRecord& record, std::size_t index) noexcept;
[[nodiscard]] RecordedTick tick_of(const BusRecord& record) noexcept;
[[nodiscard]] RecordedGiven given_of(const BusRecord& record) noexcept;
[[nodiscard]] RecordEnd end_of(const BusRecord& record) noexcept;

}  // namespace haptic::hal
