// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Records between a program with a session and the run_device that it has started. In memory:
/// the newest of each thing, written by one side and read-only to the other, which trusts none of
/// it. Over their socket: a request and its answer at the begin, then a stop or the end, one byte
/// each. Nothing queues.

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>

#include "rt_core/base/workspace_map.hpp"
#include "rt_core/exchange/newest_record.hpp"
#include "rt_core/exchange/step_trace.hpp"
#include "rt_core/safety/moving_frame.hpp"
#include "rt_core/servo_tick.hpp"
#include "tools/session/session_channel.hpp"
#include "tools/verdict/session_judge.hpp"

namespace haptic::tools {

/// Devices of a session, and processes that may render for it: the first and its spares.
inline constexpr std::size_t kSessionDevices = 2, kSessionProcesses = 4;

/// WorkspaceMap as plain numbers.
struct MapRecord {
  double scale = 1;
  double q_wd[4] = {0, 0, 0, 1}, q_ha[4] = {0, 0, 0, 1};  ///< x y z w
  double offset_w[3] = {}, grip_a[3] = {}, handle_offset_h[3] = {};
};
[[nodiscard]] MapRecord record_of(const WorkspaceMap& map) noexcept;
/// Identity where the record is none that can be used.
[[nodiscard]] WorkspaceMap map_of(const MapRecord& record) noexcept;

/// The newest tick of a device, by the process that renders.
struct SessionTick {
  std::uint64_t tick = 0;   ///< of that process, from 1 on
  std::int64_t now_ns = 0;  ///< monotonic clock, at its begin
  double hand_pose[7] = {0, 0, 0, 0, 0, 0, 1}, felt_pose[7] = {0, 0, 0, 0, 0, 0, 1};  ///< A in W
  double wrench[6] = {}, sent_wrench[6] = {};  ///< rendered, commanded; W axes
  double gap_m = 0;
  std::uint64_t state_hash = 0;
  std::uint32_t link = 0, situation = 0, flags = 0, arming = 0;
  std::uint32_t safety_faults = 0, device_faults = 0, is_held = 0, armings = 0;
  std::uint64_t late_ticks = 0, missed_periods = 0;
  std::int64_t longest_tick_ns = 0;
  std::uint64_t began_tick = 0;  ///< in which the part began last
  MapRecord map;                 ///< found then
  SessionVerdict verdict;
};

enum class SessionPhase : std::uint32_t { kStarting = 0, kRunning = 1, kEnded = 2 };

/// One device of a session, by the process that holds it.
struct SessionDeviceStatus {
  std::uint32_t link = 0, link_faults = 0;
  std::uint64_t connects = 0, reports = 0;
  double force_n = 0, torque_nm = 0;  ///< that the device may have now
  char waits_for[256] = {}, trouble[256] = {};
};

/// The run, by the process that holds the devices.
struct SessionStatus {
  SessionPhase phase = SessionPhase::kStarting;
  std::uint32_t process = 0;  ///< that renders
  std::uint32_t is_silent = 0;
  std::int32_t exit_code = 0;
  char why[512] = {};  ///< it has ended
  std::array<SessionDeviceStatus, kSessionDevices> devices;
};

/// As RunEvent.
struct SessionEvent {
  std::uint64_t number = 0;  ///< from 1 on
  double t_s = 0;            ///< since the devices are held
  std::uint32_t device = 0, level = 0;
  char name[24] = {};
  char text[464] = {};
};

/// Newest events, the oldest overwritten.
struct EventRing {
  static constexpr std::size_t kEvents = 64;
  using Record = StampedRecord<sizeof(SessionEvent) / sizeof(RecordWord)>;
  std::array<Record, kEvents> ring;
  alignas(64) std::atomic<RecordWord> newest;  ///< number of the last
};

/// Written by the process that holds the devices.
struct SessionUp {
  NewestRecord<SessionStatus> status;
  EventRing events;
};

/// Written by the program with the session.
struct SessionDown {
  NewestRecord<FrameRecord> frames;
  /// Thread that lives as long as the program does, as a futex word of the kernel's robust list:
  /// the kernel changes it first of all when the thread dies, before it gives memory back.
  alignas(64) std::atomic<std::uint32_t> life;
};

/// A session's record has this layout; equal on both sides, or nothing else of it is looked at.
struct SessionLayout {
  std::uint32_t version = 1;
  std::uint32_t real_bytes = sizeof(Real);
  std::uint32_t tick_bytes = sizeof(NewestRecord<SessionTick>);
  std::uint32_t trace_bytes = sizeof(StepTrace);
  std::uint32_t up_bytes = sizeof(SessionUp), down_bytes = sizeof(SessionDown);
  friend bool operator==(const SessionLayout&, const SessionLayout&) = default;
};

inline constexpr std::uint64_t kAskMagic = 0x6b73614e4f495345, kHelloMagic = 0x6f6c6548454c4c4f;

/// First message, of the program with the session. Descriptors: SessionDown; itself (pidfd).
struct SessionAsk {
  std::uint64_t magic = kAskMagic;
  SessionLayout layout;
  double history_s = 0;
  std::uint32_t hands = 0;  ///< that it leads; 0: as the configuration has
  std::uint32_t reserved = 0;
  std::array<std::uint8_t, 32> scene_sha256{};  ///< of the bytes of the scene
  static constexpr std::size_t kDescriptors = 2;
};

/// History that a request may ask for, at most [s].
inline constexpr double kMostSessionHistory_s = 3600;
/// Why what came is no request that can be answered, with the fix where there is one; empty: it is
/// one. `ask` has the bytes of `message`.
[[nodiscard]] std::string defect_of(const SessionMessage& message, const SessionAsk& ask);

/// A part of a memory.
struct SessionRange {
  std::uint64_t begin = 0, bytes = 0;
};

/// The answer. Descriptors: SessionUp; the memory of each process that renders.
struct SessionHello {
  std::uint64_t magic = kHelloMagic;
  SessionLayout layout;
  std::uint32_t devices = 0, processes = 0;
  std::int64_t period_ns = 0;
  double stiffness_n_per_m = 0, stiffness_nm_per_rad = 0;  ///< rendered
  struct Device {
    MapRecord map;
    std::uint32_t finds_place = 0, finds_turn = 0;
    double start_pose[7] = {0, 0, 0, 0, 0, 0, 1};
    SessionRange flight, tick;  ///< of the memory of each process
  };
  std::array<Device, kSessionDevices> of;
  static constexpr std::size_t kMostDescriptors = 1 + kSessionProcesses;
};

/// Then, of the program with the session.
inline constexpr char kSessionStop = 's', kSessionClose = 'c';
/// And of run_device, once: it holds the devices.
inline constexpr char kSessionBegun = 'b';

static_assert(std::is_trivially_copyable_v<SessionAsk> &&
              std::is_trivially_copyable_v<SessionHello> &&
              std::is_trivially_copyable_v<SessionTick> &&
              std::is_trivially_copyable_v<SessionStatus>);

/// Cut to what fits, and ended.
template <std::size_t N>
void put_text(std::string_view text, char (&to)[N]) noexcept {
  std::memset(to, 0, N);
  std::memcpy(to, text.data(), std::min(text.size(), N - 1));
}
/// The text of a field that may have no end.
template <std::size_t N>
[[nodiscard]] std::string_view text_in(const char (&from)[N]) noexcept {
  return {from, static_cast<std::size_t>(std::find(from, from + N, '\0') - from)};
}

/// Owner: the one thread that writes.
class EventWriter {
 public:
  explicit EventWriter(EventRing& ring) noexcept : ring_(&ring) {}
  /// Wait-free: one copy.
  void write(SessionEvent event) noexcept {
    event.number = ++written_;
    ring_->ring[written_ % EventRing::kEvents].write(
        written_, std::bit_cast<EventRing::Record::Words>(event));
    ring_->newest.store(written_, std::memory_order_release);
  }

 private:
  EventRing* ring_;
  RecordWord written_ = 0;
};

/// Event of that number; false: it is not there any more, or not yet. Any bytes in the ring are
/// safe.
[[nodiscard]] inline bool copy_event(const EventRing& ring, std::uint64_t number,
                                     SessionEvent& event) noexcept {
  EventRing::Record::Words words;
  if (!ring.ring[number % EventRing::kEvents].copy(number, words)) return false;
  event = std::bit_cast<SessionEvent>(words);
  return true;
}

}  // namespace haptic::tools
