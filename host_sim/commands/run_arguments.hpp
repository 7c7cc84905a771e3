// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Arguments of `host_sim run`, and what comes of them for a hand.

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "host_sim/report/part_report.hpp"
#include "host_sim/session/core_session.hpp"
#include "host_sim/session/drive_run.hpp"
#include "host_sim/session/motion_script.hpp"
#include "tools/live/live_session.hpp"

namespace haptic::sim {

struct RunArguments {
  std::string scene, out, html, mcap, hand = "light", device, script, script2, carrier = "none",
                                      faults, record;
  std::vector<std::string> drives;
  std::optional<double> seconds, rate_hz;
  std::optional<unsigned> delay;
  bool report_clocked = false, json = false, serve = false;
  tools::ServeOptions live;

  /// A hand that presses on the nearest part, in the time that this takes.
  [[nodiscard]] bool is_made_to_press() const {
    return script.empty() && !seconds && hand != "none";
  }
  /// Writes the files, and the account to stdout where that is asked for.
  void keep(const std::vector<OutputText>& files, const nlohmann::ordered_json& json) const;
  void keep_drives(const DriveRun& drives) const;
};

/// Once the run is over: until the program is stopped.
void stay(tools::LiveSession& live);

/// A hand's motion, and its commands.
struct HandWay {
  std::vector<MotionSample> motion;
  std::vector<HoldCommand> holds;
};

/// By `script`, or pressing where that is empty; at the loop's rate, and for the seconds that are
/// asked for: cut, or held at its end. @throws tools::InputError as read_motion_script.
[[nodiscard]] HandWay hand_way(const RunArguments& o, const std::string& script,
                               CoreSession& session, double rate_hz);

}  // namespace haptic::sim
