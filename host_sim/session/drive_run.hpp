// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Owners of driven parts, as a run plays them: each gives the poses of a file at their times, and
/// what became of that.

#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "host_sim/session/core_session.hpp"
#include "host_sim/session/motion_script.hpp"
#include "tools/verdict/tick_record.hpp"

namespace haptic::sim {

/// The poses that an owner gives to a part.
struct DriveStream {
  std::string part, file;
  std::vector<MotionSample> poses;  ///< of the part's mesh frame in W, times increasing
};

/// Reads PART=FILE: a motion script, whose rate is that of the poses, or a motion as CSV, whose
/// rows are the poses: a gap in its times is one in the stream.
/// @throws tools::UsageError without a part or a file; tools::InputError as the readers of both.
[[nodiscard]] DriveStream read_drive(const std::string& argument);

[[nodiscard]] std::vector<DriveStream> read_drives(const std::vector<std::string>& arguments);

/// Help of the option --drive.
inline constexpr const char* kDriveHelp =
    "PART=MOTION: an owner gives a driven part the poses of a motion (TOML, at its rate; CSV, at "
    "their times); may be given for several parts";

/// A driven part in a whole run, or a loose one, whose anchor it lags behind.
struct DrivenAccount {
  std::string part;
  std::uint64_t poses = 0;  ///< that were given
  double largest_lag_m = 0, largest_lag_rad = 0;
  double lag_at_s = 0;        ///< of the largest lag in place
  double largest_push_n = 0;  ///< by what it touches
  double touched_s = 0;       ///< so long did it touch the part in the hand
  double lost_s = 0;          ///< so long was its stream lost
  double lost_from_s = 0;     ///< since when, the first time
  double released_s = 0;      ///< so long was it a cause to release the hand
  bool is_loose = false;
  double moved_m = 0;  ///< where a loose part ends, from its start
};

/// A line for each.
[[nodiscard]] std::string driven_text(const std::vector<DrivenAccount>& driven);
[[nodiscard]] nlohmann::ordered_json driven_json(const std::vector<DrivenAccount>& driven);

/// Owner: the thread of the loop. `session` must outlive it.
class DriveRun {
 public:
  /// @throws tools::InputError for a scene without driven parts, a part that is none of them, and
  /// one that is driven twice.
  DriveRun(CoreSession& session, std::vector<DriveStream> streams);

  /// The newest poses at `t_s`, by driven part, as a tick is given them.
  [[nodiscard]] std::span<const FrameRecord> at(double t_s);
  /// The same for the hand's tick.
  [[nodiscard]] DrivenInput input(double t_s);
  /// The same, given to the hand: where nothing else does that.
  void before_tick(double t_s);
  /// `second`: of a second hand; null: there is none.
  void after_tick(const tools::TickRecord& tick, const StepResult* second = nullptr);
  /// Energy of the hand's spring from driven parts so far, less what it gave them: not made by the
  /// rendering.
  [[nodiscard]] double given_j() const { return given_j_; }

  /// Stamp of the records, and of the ticks that they are for, at a time of the run.
  [[nodiscard]] static std::int64_t stamp_ns(double t_s);

  [[nodiscard]] const std::vector<DrivenAccount>& accounts() const { return accounts_; }
  /// A line for every tick and part, with header; LF. Empty: the scene has no driven part.
  [[nodiscard]] const std::string& csv() const { return csv_; }
  /// Failures: lost streams; empty: none.
  [[nodiscard]] std::string failures() const;

 private:
  struct Player {
    std::vector<MotionSample> poses;
    std::size_t next = 0;
  };

  CoreSession& session_;
  std::vector<Player> players_;       ///< by driven part; without poses: it stands at its start
  std::vector<FrameRecord> records_;  ///< the same
  std::vector<DrivenAccount> accounts_;
  std::string csv_;
  double last_s_ = 0, given_j_ = 0;
  bool is_felt_ = true;  ///< the last tick had a force
  bool has_last_ = false;
};

}  // namespace haptic::sim
