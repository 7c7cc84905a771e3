// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The events of a run, reported when they happen: connections, arming, faults, trouble of the
/// link, ends of processes. Found by comparing one look at the run with the one before.

#include <cstdint>
#include <functional>
#include <string>

#include "rt_core/exchange/device_exchange.hpp"
#include "rt_core/safety/arming.hpp"
#include "tools/run_device/teller.hpp"

namespace haptic::tools {

struct RunStatus;

struct RunEvent {
  unsigned device = 0;  ///< 1 and 2 of two; 0: of the run, or of the only one
  double t_s = 0;       ///< since the devices are held
  /// "connected", "disconnected", "armed", "arming", "disarming", "disarmed", "faulted", "fault",
  /// "trouble", "silent", "servo ended", "spare begins", "keeper ended", "stopping", "crash file",
  /// "begun" (where the part begins), "waiting" (why nothing arms), "too fast" (why an armed device
  /// gets no force).
  std::string event;
  std::string text;  ///< one line, for people
  LineLevel level = LineLevel::kNotice;
};

[[nodiscard]] const char* to_text(ArmingState arming);
[[nodiscard]] const char* to_text(LinkState link);
/// Faults of the servo and of the device or its link, by their names; empty: none.
[[nodiscard]] std::string faults_text(std::uint32_t safety, std::uint32_t device);

/// Owner: the thread that watches the run.
class RunEvents {
 public:
  /// `device`: as in RunEvent.
  RunEvents(std::function<void(const RunEvent&)> told, unsigned device)
      : told_(std::move(told)), device_(device) {}

  /// Reports the changes since the last look.
  void look(const RunStatus& status);
  /// A cause that has delayed an arming for this long is reported, once.
  static constexpr double kLongWait_s = 1.0;
  void tell(double t_s, const std::string& event, const std::string& text, LineLevel level) const;

 private:
  void look_at_arming(const RunStatus& status);
  void look_at_speed(const RunStatus& s);

  std::function<void(const RunEvent&)> told_;
  unsigned device_;
  LinkState link_ = LinkState::kAbsent;
  ArmingState arming_ = ArmingState::kDisarmed;
  std::uint32_t safety_faults_ = 0, device_faults_ = 0;
  bool silent_ = false;
  std::string trouble_;
  std::uint32_t begins_ = 0;
  std::uint32_t waits_ = 0;  ///< ArmingWait, since waits_from_s_
  double waits_from_s_ = 0;
  bool wait_told_ = false;
  double fast_from_s_ = 0;
  bool fast_told_ = false;
};

}  // namespace haptic::tools
