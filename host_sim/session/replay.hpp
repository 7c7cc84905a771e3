// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Runs a motion through the core, or through the paper's literal steps, optionally against the
/// oracle.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host_sim/oracle/literal_tracker.hpp"
#include "host_sim/oracle/scene_oracle.hpp"
#include "host_sim/session/core_session.hpp"
#include "host_sim/session/drive_run.hpp"
#include "host_sim/session/drive_tape.hpp"
#include "host_sim/session/tick_csv.hpp"

namespace haptic::sim {

struct ReplayOptions {
  bool check = false;                   ///< compare every pair of every tick with the oracle
  std::optional<DeltaReading> literal;  ///< the paper's literal steps instead of the core
  bool contacts = false;                ///< keep the contacts of every tick of the core
  bool progress = false;                ///< a status line on stderr
  bool expects_contact = false;         ///< a motion that was made to touch
  DriveRun* drives = nullptr;  ///< owners of driven parts; null: these stand at their starts
  DriveTape* tape = nullptr;   ///< keeps what they give, for a page; with `drives`
};

struct ReplayResult {
  std::vector<TickRecord> ticks;
  /// Verdict on the core; the literal method is not judged.
  std::optional<tools::SessionVerdict> verdict;
  std::optional<CheckTotals> check;
  std::string contact_csv;  ///< session/contact_log.hpp; empty unless asked for
};

/// Starts from a forgotten contact history. Cost without a check: the ticks themselves; the check
/// adds an exhaustive long double search per pair-tick.
[[nodiscard]] ReplayResult replay(CoreSession& session, std::span<const MotionSample> motion,
                                  const ReplayOptions& options);

}  // namespace haptic::sim
