// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The servo process of `run_device run`, and its messages to the process that holds the device: a
/// status after each tick, and an account that is read once it has ended.

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

#include "hal/clock/linux_process.hpp"
#include "hal/realtime/device_guardian.hpp"
#include "hal/realtime/histograms.hpp"
#include "hal/realtime/late_causes.hpp"
#include "hal/realtime/servo_loop.hpp"
#include "hal/realtime/wakeup_measurement.hpp"
#include "rt_core/exchange/newest_record.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/run_device/arming_words.hpp"
#include "tools/run_device/device_config.hpp"
#include "tools/run_device/device_fit.hpp"
#include "tools/session/session_records.hpp"
#include "tools/verdict/session_judge.hpp"

namespace haptic::tools {

/// How late a tick was: woken within a quarter of the period, within the period, up to
/// SafetyLimits::lost_periods late (the last wrench is held and decays), or beyond (ramp to zero).
enum class LateDegree : std::uint8_t { kInTime = 0, kWithinPeriod, kHeld, kBeyond, kCount };
inline constexpr std::size_t kLateDegrees = static_cast<std::size_t>(LateDegree::kCount);

/// Ticks of one servo process, or of several one after the other.
struct TickCounts {
  std::uint64_t ticks = 0, armed_ticks = 0;
  std::uint64_t contact_ticks = 0;  ///< of those armed
  std::array<std::uint64_t, kLateDegrees> late{};
  hal::CauseCounts causes{};  ///< all of a tick's time is taken for its work
  std::uint32_t armings = 0, safety_faults = 0, device_faults = 0;  ///< faults: ever seen
  double largest_force_n = 0, largest_torque_nm = 0;                ///< commanded
};

/// Times of the ticks that are counted.
struct ServoTimes {
  hal::IntervalHistogram wakeups;  ///< how late
  hal::IntervalHistogram ticks;    ///< from the look at the clock to the command published
};

/// Which ticks are counted: all, or as many as asked for from the first on in which a device is
/// armed.
enum class CountWindow : std::uint8_t { kNotYet = 0, kOpen, kOver };

/// After a tick, for people who watch.
struct ServoStatus {
  TickCounts counts;
  ArmingState arming = ArmingState::kDisarmed;
  std::uint32_t safety_faults = 0, device_faults = 0;  ///< now
  double force_n = 0, torque_nm = 0;                   ///< commanded
  double d_near_m = 0;
  /// Armed ticks in a row in which the hand is so fast that the limits leave no force, and the
  /// largest speed that the device has stated in them; 0: it states none.
  std::uint64_t too_fast_ticks = 0;
  double stated_m_per_s = 0;
  ArmingNews arming_news;
  SessionVerdict verdict;  ///< of all ticks so far in which the core rendered, armed or not
};

/// Requests of a servo process to Linux, and the answers.
struct ServoGrants {
  std::array<hal::StepGrant, 3> process;
  std::array<hal::StepGrant, 4> thread;
  int filter = 0;  ///< errno of hal::confine_servo
};

/// At its end; a process that was killed leaves none.
struct ServoClose {
  std::atomic<bool> told{false};
  hal::PageFaults faults;             ///< of the servo thread within the loop
  std::int64_t heap_grown_bytes = 0;  ///< bytes of the heap in use, against before the loop
  int loop_error = 0;                 ///< errno of a sleep that failed
};

/// ServoSeat::report of each servo process. The reader takes no harm from what a process that has
/// gone wild leaves there. Counts of ticks are those of the process, the same for each device.
struct ServoBoard {
  std::array<NewestRecord<ServoStatus>, kMostHands> status;   ///< by device
  std::array<NewestRecord<SessionTick>, kMostHands> session;  ///< the same, for a program with one
  std::atomic<bool> ready{false};  ///< grants are reported, the loop begins
  ServoGrants grants;
  hal::WakeupMeasurement wakeups;  ///< of its thread before the loop, where they are asked for
  ServoClose close;
  std::atomic<CountWindow> window{CountWindow::kNotYet};
  ServoTimes times;  ///< read once the process has ended
};

/// The newest status; what a servo process that went wild has written there is some status too.
[[nodiscard]] ServoStatus status_of(const ServoBoard& board, std::size_t device) noexcept;

/// Body of a servo process, whose order is the number of ticks wanted (0: all); @return its exit
/// code. Everything that it works with is its own: the scene is copied, so that no page of it is
/// shared with the parent.
[[nodiscard]] int serve(const DeviceConfig& config, const SceneBytes& scene,
                        const hal::ServoSeat& seat);

/// Asks for the process-wide grants; a lock of memory that would refuse what is allocated later is
/// taken back and counts as refused (ENOMEM).
[[nodiscard]] std::array<hal::StepGrant, 3> start_process(hal::RealtimeProcess& process,
                                                          const hal::ProcessSettings& settings);

/// Demands of scene, map and loop on a device.
[[nodiscard]] FitQuestion fit_question(const DeviceConfig& config, const SceneBytes& scene,
                                       std::size_t device);

/// The loop ticks at each report of this device.
[[nodiscard]] bool clocks_loop(const DeviceConfig& config, std::size_t device);

/// Records of the flight recorder for the configured time.
[[nodiscard]] std::size_t flight_records(const DeviceConfig& config);

/// The scene read and tried: a core can be built over it, and it has a hand for each device; a
/// scene without a [device] with what the simulated handle holds, where that is a device. Which
/// bodies were simplified, and which gains are lower than the scene's, is said on standard error.
/// @throws InputError
[[nodiscard]] SceneBytes read_usable_scene(const DeviceConfig& config);

}  // namespace haptic::tools
