// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Plays a recorded session (hal/usb/bus_record.hpp) back: the recorded reports go through the bus
/// in this process, the real libusb, link, driver, guard, servo tick and core, in one thread and in
/// the recorded time. The output must be what was recorded, bit for bit.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "host_sim/device/played_servo.hpp"
#include "host_sim/session/core_session.hpp"

namespace haptic::sim {

struct PlayResult {
  std::uint64_t ticks = 0, reports = 0, sends = 0, connects = 0;  ///< that were equal
  /// Ticks after the link's end: nothing on its tape says what they saw.
  std::uint64_t ticks_beyond = 0;
  double duration_s = 0;
  bool complete = true;                  ///< the file is whole
  std::string cut;                       ///< else where it ends
  bool diverged = false;                 ///< and here is the first place where:
  std::uint64_t tick = 0;                ///< the servo tick that used it; 0: none did
  std::uint64_t record = 0, offset = 0;  ///< of the file
  std::string text;                      ///< what was expected and found, and the reports around it
};

/// Plays `file`, named `name` in messages. Its servo loop may have run in any thread; the link's
/// tape and the ticks are each played in their own order, and a tick waits for the state that it
/// saw, a send for the command that it took. A file that ends early is played to its last whole
/// record. `watch`: called after each servo tick that was equal. A program that plays links
/// haptic_usbfs. Changes the history of the session's core.
/// @throws tools::InputError  no recording, a damaged one (record and byte), one that dropped
///         something, another scene, an unknown driver.
[[nodiscard]] PlayResult play_session(CoreSession& session, std::span<const std::uint8_t> file,
                                      const std::string& name, PlayWatch watch = {});

/// The bytes of a file. @throws tools::InputError.
[[nodiscard]] std::vector<std::uint8_t> read_recording(const std::string& path);

}  // namespace haptic::sim
