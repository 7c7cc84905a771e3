// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What goes into one tick and what comes out of it.

#include <cstdint>

#include "rt_core/base/pose.hpp"
#include "rt_core/base/status.hpp"
#include "rt_core/base/step_flags.hpp"
#include "rt_core/contact/contact_situation.hpp"
#include "rt_core/tick/guidance.hpp"

namespace haptic {

/// What one tick is given. Owner: the caller. The contact computation reads the pose alone; stamp,
/// twist and accepted wrench serve coupling damping and passivity; switches and faults are what a
/// device reports with it and belong to the stages between device and law.
struct StepInput {
  std::uint64_t sequence = 0;  ///< of the device report
  std::int64_t stamp_ns = 0;   ///< host time of the report, monotonic clock; 0: not stamped
  Pose pose_wa;   ///< A's mesh frame in W; of a part that never turns the orientation is not used
  Twist twist_w;  ///< meaningful only when twist_valid
  bool twist_valid = false;
  bool clutched = false;  ///< the goal stays where it is, the wrench ramps out
  /// The wrench that acted on the device since the last report, after every limit behind the core;
  /// when it is not valid the core's own last output is taken.
  Wrench accepted_wrench_w;
  bool accepted_valid = false;
  std::uint32_t switches = 0;       ///< device buttons, bit set = pressed
  std::uint32_t device_faults = 0;  ///< device faults, bit set = present
  /// Law kProxy: search the contact at the goal pose too (D_near, verdicts and near sets there).
  /// Neither the wrench nor the state hash depends on it. The other laws always search it.
  bool report_goal_contact = false;
  bool guide_off = false;  ///< the scene's guide lets go, if it has one; the contact is the same
};

/// Work of one tick, against the bounds in the scene's header (SceneCapacity).
struct StepCounters {
  std::uint32_t pair_visits = 0;
  std::uint32_t support_pairs = 0;
  std::uint32_t feature_evaluations = 0;
  std::uint32_t edge_pairs = 0;
  std::uint32_t near_nodes = 0;
  std::uint32_t hull_points = 0;
  std::uint32_t stale_pairs = 0;  ///< visits, but a pair's first, with every bound stale: jumps
  std::uint32_t proxy_passes = 0;
  std::uint32_t proxy_rejected = 0;  ///< passes that found no step to certify
  std::uint32_t proxy_rounds = 0;    ///< of the pass that had most
  std::uint32_t proxy_rows = 0;      ///< of the quadratic program that had most
  std::uint32_t qp_iterations = 0;   ///< of the quadratic program that had most
  std::uint32_t plane_gaps = 0;      ///< gaps along C-face planes computed for the proxy
  std::uint32_t valid_nodes = 0;     ///< nodes looked at in searches for valid planes
  std::uint32_t full_searches = 0;   ///< searches of a pair without history
  std::uint32_t search_work =
      0;  ///< of these: faces and edges, eighths of edge pairs, support pairs
  std::uint32_t qp_programs = 0;  ///< quadratic programs solved
  std::uint32_t qp_steps = 0;     ///< iterations of all of them
  std::uint32_t list_visits = 0;  ///< nodes of the trees that lists of near pairs looked at
  std::uint32_t work_units = 0;   ///< of the proxy, as its budget counts them
};

/// What one tick returns.
struct StepResult {
  Wrench wrench_w;  ///< reaction on the hand; torque about the grip point, W axes
  /// The part of wrench_w that is the spring's pull, ramps included; the rest is damping: the
  /// coupling's, and what the passivity controller added. Laws without a coupling are spring as a
  /// whole, and so is a wrench that a ramp out holds: it answers to no velocity any more.
  Wrench spring_w;
  /// Of a scene with a guide: what leads the hand, to be added to wrench_w. Neither wrench_w nor
  /// anything else here depends on it but the hash.
  Guidance guidance;
  /// Contact of the part as it is felt. Law kProxy: of the free configuration proxy_pose_wa, over
  /// the planes that hold it (HapticCore::felt_contact). Other laws: of nearest_pair at the goal,
  /// or of the next deepest pair where all contacts of that one belong to another piece.
  ContactSituation situation = ContactSituation::kNone;
  std::uint32_t near_count = 0;  ///< law kProxy: contact points; others: nodes of the near set
  /// The goal pose was searched: by StepInput::report_goal_contact, or because the law needs it.
  /// Only then are d_near_m, nearest_pair, kGoalContactFlags and the counters of the search given.
  bool has_goal_contact = false;
  /// Smallest D_near over all pairs at the goal pose, <= 0: collision. A pair that is apart has it
  /// over all of its nodes, one that collides over those that carry force, or over all where none
  /// of them applies. Exact but for kFlagFarBand, kFlagInexact and kFlagBudgetUsedUp. Else
  /// kNotSearched.
  Real d_near_m = kNotSearched;
  std::uint32_t nearest_pair = 0;  ///< the pair it belongs to (lowest index at ties)
  RtStatus status = RtStatus::kOk;
  std::uint32_t flags = 0;    ///< StepFlag
  std::uint32_t outside = 0;  ///< EnvelopeSide of the scene's envelope, in this tick
  StepCounters counters;
  /// The device's pose with the offsets that clutch and anchor have added, and of law kProxy held
  /// inside the scene's envelope: D_near is that of this pose.
  Pose goal_pose_wa;
  /// Law kProxy: where the part is shown, always free of obstacles but for proxy_gap_m; other laws:
  /// the goal, which is the device's pose after clutch and anchor.
  Pose proxy_pose_wa;
  Real proxy_gap_m = 0;  ///< law kProxy: smallest gap of the proxy, a lower bound of its distance
  Real potential_j = 0;  ///< law kProxy: energy of the coupling spring
  std::uint32_t behind_ticks = 0;  ///< ticks in a row, to this one, with kFlagBehind
  Twist device_twist_w;            ///< estimate, where the scene names a device
  /// Passivity observer: minus what the rendering has generated beyond the spring's own energy and
  /// the device's damping and has not been taken out yet; at most 0.
  Real energy_j = 0;
  /// Of this tick's result and all before it; equal runs have equal hashes.
  std::uint64_t state_hash = 0;
};

/// Largest counts seen since the last reset.
using StepPeaks = StepCounters;
/// Raises each count of `peaks` to that of `counters`.
void raise_peaks(const StepCounters& counters, StepPeaks& peaks) noexcept;

}  // namespace haptic
