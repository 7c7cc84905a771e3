// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The servo thread of a recorded session: its ticks in their order, each once the state that it
/// saw has been published.

#include <cstdint>
#include <deque>
#include <memory>
#include <span>
#include <string>

#include "hal/usb/bus_record.hpp"
#include "host_sim/session/core_session.hpp"
#include "host_sim/device/recorded_tracks.hpp"

namespace haptic::sim {

/// Owner: one thread; session and file outlive it.
class PlayedServo {
 public:
  PlayedServo(CoreSession& session, const hal::BusSession& header,
              std::span<const std::uint8_t> file, std::size_t first);

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

  CoreSession& session_;
  ServoParameters parameters_;
  TickTrack track_;
  std::unique_ptr<ServoTick> tick_;
  std::deque<haptic::DeviceState> states_;  ///< published, from the one last seen on
  std::deque<DeviceCommand> commands_;      ///< made, from the one last taken on
  std::string difference_;
  std::uint64_t ticks_ = 0;
};

}  // namespace haptic::sim
