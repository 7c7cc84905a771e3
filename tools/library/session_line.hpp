// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A device of a session: the simulated handle with the hand on it, driver, link and its thread,
/// and what the newest tick was for it.

#include <cstddef>
#include <cstdint>
#include <span>

#include "hal/drivers/reference_driver.hpp"
#include "hal/local/local_link.hpp"
#include "hal/realtime/servo_loop.hpp"
#include "hal/usb/usb_thread.hpp"
#include "rt_core/exchange/newest_record.hpp"
#include "rt_core/servo_tick.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/library/bodies.hpp"
#include "tools/library/guided_hand.hpp"
#include "tools/library/haptic.h"
#include "tools/run_device/simulated_peer.hpp"
#include "tools/verdict/session_judge.hpp"

namespace haptic::tools {

struct LineSettings {
  std::int64_t period_ns = 1'000'000;
  double history_s = 0;
  int priority = 0;  ///< of the servo thread
};

/// Owner: that of the session. `state`, `verdict` and `history` from any thread.
class SessionLine {
 public:
  /// `scene`: of the part that the hand holds; it outlives this.
  SessionLine(const SceneView& scene, const LineSettings& settings);
  SessionLine(const SessionLine&) = delete;
  SessionLine& operator=(const SessionLine&) = delete;

  /// Its thread begins. False: it cannot be had.
  [[nodiscard]] bool start() { return thread_.start().create_error == 0; }
  void begin_stop() noexcept { thread_.begin_stop(); }
  /// The force ramps to zero, while the loop still ticks.
  void stop() noexcept { thread_.stop(); }
  void emergency_stop() noexcept;

  [[nodiscard]] const hal::DeviceMailbox& mailbox() const noexcept { return mailbox_; }
  [[nodiscard]] const ServoParameters& parameters() const noexcept { return parameters_; }
  [[nodiscard]] FlightRecorder& recorder() noexcept { return recorder_; }

  /// Servo thread. What is not of the device is in `newest` already: parts, and the time.
  void note(const ServoInput& input, const ServoResult& result,
            const hal::ServoLoopCounters& counters, std::int64_t opened_ns,
            const HeldNow& held) noexcept;

  void state(haptic_state& state) const noexcept;
  [[nodiscard]] SessionVerdict verdict() const noexcept;
  [[nodiscard]] HeldNow held() const noexcept;
  [[nodiscard]] std::size_t history(std::span<haptic_tick> ticks, std::int64_t opened_ns) const;
  /// `pose`: of A in W. @return the number of the goal.
  std::uint64_t move_hand(const double* pose, double seconds) noexcept;
  void hold(haptic_hold hold) noexcept;

 private:
  /// As the servo thread leaves it after a tick.
  struct NewestTick {
    haptic_state state;
    SessionVerdict verdict;
    HeldNow held;
  };
  static_assert(sizeof(NewestTick) % sizeof(RecordWord) == 0);

  SceneBytes history_memory_;
  hal::ReferenceDriver driver_;
  ServoParameters parameters_;
  hal::MailboxMemory mailbox_;
  GuidedHand hand_;
  HandOrder order_;
  SimulatedPeer peer_;
  hal::LocalLink link_;
  hal::UsbThread thread_;
  FlightRecorder recorder_;
  SessionJudge judge_;  ///< servo thread
  NewestRecord<NewestTick> newest_;
  NewestWriter<NewestTick> newest_writer_{newest_};
};

}  // namespace haptic::tools
