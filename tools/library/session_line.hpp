// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A device of a session: the simulated handle with the hand on it, driver, link and its thread,
/// and what the newest tick was for it.

#include <cstdint>

#include "hal/drivers/reference_driver.hpp"
#include "hal/local/local_link.hpp"
#include "hal/realtime/servo_loop.hpp"
#include "hal/usb/usb_thread.hpp"
#include "rt_core/servo_tick.hpp"
#include "tools/library/guided_hand.hpp"
#include "tools/library/haptic.h"
#include "tools/library/tick_notes.hpp"
#include "tools/run_device/simulated_peer.hpp"

namespace haptic::tools {

struct LineSettings {
  std::int64_t period_ns = 1'000'000;
  double history_s = 0;
  int priority = 0;  ///< of the servo thread
};

/// Owner: that of the session. `notes` are for any thread to read.
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
  [[nodiscard]] FlightRecorder& recorder() noexcept { return notes_.recorder(); }
  [[nodiscard]] const TickNotes& notes() const noexcept { return notes_; }

  /// Servo thread.
  void note(const ServoInput& input, const ServoResult& result,
            const hal::ServoLoopCounters& counters, std::int64_t opened_ns,
            const HeldNow& held) noexcept;

  /// `pose`: of A in W. @return the number of the goal.
  std::uint64_t move_hand(const double* pose, double seconds) noexcept;
  void hold(haptic_hold hold) noexcept;

 private:
  hal::ReferenceDriver driver_;
  ServoParameters parameters_;
  hal::MailboxMemory mailbox_;
  GuidedHand hand_;
  HandOrder order_;
  SimulatedPeer peer_;
  hal::LocalLink link_;
  hal::UsbThread thread_;
  TickNotes notes_;
};

}  // namespace haptic::tools
