// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The commands of a script to the hand, done tick by tick, and what each of them did to what is
/// felt.

#include <cstddef>
#include <string>
#include <vector>

#include "host_sim/session/core_session.hpp"
#include "host_sim/session/motion_script.hpp"
#include "tools/verdict/tick_record.hpp"

namespace haptic::sim {

/// A part that was let go, or taken.
struct HoldEvent {
  double t_s = 0;      ///< when it was done
  double asked_s = 0;  ///< when the script asked for it
  bool taken = false;  ///< else let go
  std::string part;
  double force_n = 0;  ///< felt when it was asked for
  /// Largest changes from tick to tick until the hand is empty, or for kTakenWatch_s after the part
  /// was taken.
  double force_step_n = 0, torque_step_nm = 0;
  double moved_m = 0;  ///< the part's place, by being let go or taken
};

/// A hand is watched for so long after it has taken a part [s].
inline constexpr double kTakenWatch_s = 0.2;
/// No part may move farther by a hold [m].
inline constexpr double kMostMovedByHold_m = 10e-6;

/// Owner: the thread of the loop. `session` must outlive it.
class HoldRun {
 public:
  /// @throws tools::InputError for commands of a scene without parts, and for a part that it does
  /// not have or that may not be held.
  HoldRun(CoreSession& session, std::vector<HoldCommand> commands);

  void before_tick(double t_s);
  void after_tick(const tools::TickRecord& tick);

  [[nodiscard]] const std::vector<HoldEvent>& events() const { return events_; }
  /// Failures: what the script asked for and was not done, and what moved a part; empty: none.
  [[nodiscard]] std::string failures() const;

 private:
  void let_go(double asked_s);
  void take(double t_s, double asked_s, std::uint32_t part);
  [[nodiscard]] std::uint32_t number_of(const std::string& part) const;

  CoreSession& session_;
  std::vector<HoldCommand> commands_;
  std::vector<HoldEvent> events_;
  std::size_t next_ = 0;     ///< command
  bool is_watched_ = false;  ///< the last event
  tools::TickRecord last_{};
  PartPlace asked_place_;  ///< of the part when it was asked for
};

}  // namespace haptic::sim
