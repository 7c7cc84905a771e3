// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The record that a replay keeps of every tick, and its CSV.

#include <cmath>
#include <cstdint>
#include <span>
#include <string>

#include "rt_core/haptic_core.hpp"
#include "tools/plan/guide_legs.hpp"
#include "tools/verdict/flag_names.hpp"
#include "tools/verdict/session_judge.hpp"

namespace haptic::sim {

using tools::GuideLegs;
using tools::kFlagCount;
using tools::kFlagLocalSetEmpty;

[[nodiscard]] inline double length_of(const double (&v)[3]) {
  return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

/// Guide of a tick: what leads the hand besides the contact, and where on the plan it is.
struct TickGuide {
  GuideState state = GuideState::kNone;
  std::uint32_t station = 0;        ///< the last one passed
  double force_n[3] = {0, 0, 0};    ///< on the hand, W axes
  double torque_nm[3] = {0, 0, 0};  ///< about the grip point, W axes
  double to_go_m = 0, off_m = 0;    ///< length of the rest of the way; distance from it
};

struct TickRecord {
  std::uint64_t tick = 0;
  double t_s = 0;
  double force_n[3] = {0, 0, 0};    ///< on the hand, W axes
  double torque_nm[3] = {0, 0, 0};  ///< about the grip point, W axes
  double d_near_m = 0;              ///< smallest over the pairs; <= 0: collision
  ContactSituation situation = ContactSituation::kNone;
  bool in_contact = false;  ///< the part as it is felt touches: tools::felt_part_touches
  double pull_n = 0;        ///< force of the spring alone: StepResult::spring_w
  std::uint32_t near_count = 0;
  std::uint32_t nodes_evaluated = 0;  ///< faces, edges and pairs of edges
  std::uint32_t support_pairs = 0;
  std::uint32_t relocalised_pairs = 0;  ///< pairs of which every bound had become stale
  std::uint32_t flags = 0;              ///< StepFlag
  RtStatus status = RtStatus::kOk;
  std::uint64_t state_hash = 0;
  double proxy_gap_m = 0;  ///< law proxy: smallest gap of the proxy
  double energy_j = 0;     ///< of the passivity observer
  /// Law proxy: distance of the part as it is felt from the goal that the device asks for, at the
  /// grip point. Other laws: 0.
  double apart_m = 0;
  TickGuide guide;
  /// A's mesh frame in W: as the core was asked for it, and of the part as it is felt. Laws other
  /// than proxy feel it where it is asked for.
  Pose device_wa, proxy_wa;
};

/// The quantities of a tick that are judged.
[[nodiscard]] tools::JudgedTick judged_tick(const TickRecord& record) noexcept;

/// The record of tick number `tick` from the core's result under `law`; the pose of the device is
/// the goal, for the caller to change where it knows better. `grip_a`: grip point in A's mesh frame
/// [m].
[[nodiscard]] TickRecord record_of(std::uint64_t tick, double t_s, const StepResult& result,
                                   LawId law, const Vec3& grip_a = Vec3::Zero());
/// Grip point of the scene's moving part in A's mesh frame [m].
[[nodiscard]] Vec3 grip_in_part(const SceneView& view);

/// Header of the replay's CSV, without the end of line.
inline constexpr const char* kTickCsvHeader =
    "tick,t_s,fx_n,fy_n,fz_n,tx_nm,ty_nm,tz_nm,d_near_m,state,near_count,nodes_evaluated,flags,"
    "state_hash,proxy_gap_m,energy_j";

/// Appends one line of the CSV, without its end.
void append_tick_row(std::string& csv, const TickRecord& tick);

/// Poses of the felt part and of the device's, each p_wa [m] and quaternion w x y z, as columns
/// that follow others.
inline constexpr const char* kPoseCsvHeader =
    ",proxy_x_m,proxy_y_m,proxy_z_m,proxy_qw,proxy_qx,proxy_qy,proxy_qz,device_x_m,device_y_m,"
    "device_z_m,device_qw,device_qx,device_qy,device_qz";
void append_poses(std::string& csv, const TickRecord& tick);

/// Columns that end each line in a scene with a guide; empty in others. guide: off, lost or on;
/// guide_place: GuideLegs::place, in quotation marks.
[[nodiscard]] std::string guide_csv_header(const GuideLegs& legs);
void append_guide(std::string& csv, const TickGuide& guide, const GuideLegs& legs);

/// CSV of a replay, its columns as COLUMNS.md has them; the poses end each line. 17 significant
/// digits, LF.
[[nodiscard]] std::string tick_csv(std::span<const TickRecord> ticks, const GuideLegs& legs = {});

}  // namespace haptic::sim
