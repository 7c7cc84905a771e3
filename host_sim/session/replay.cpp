// SPDX-License-Identifier: Apache-2.0
#include "host_sim/session/replay.hpp"

#include <algorithm>
#include <cstdio>

#include "host_sim/session/contact_log.hpp"

namespace haptic::sim {
namespace {

/// One tick of the core; `values` gets one per pair where it has room, `goal_wa` the pose that they
/// belong to.
TickRecord core_tick(CoreSession& session, const StepInput& input, double t_s, const Vec3& grip_a,
                     Pose& goal_wa, std::vector<PairValue>& values) {
  const StepResult result = session.step(input);
  const HapticCore& core = session.core();
  for (std::uint32_t k = 0; k < values.size(); ++k) {
    const PairReport report = core.pair_report(k);
    values[k] = {static_cast<double>(report.d_near_m), report.exact};
  }
  goal_wa = result.goal_pose_wa;
  TickRecord record =
      record_of(input.sequence, t_s, result, session.view().parameters().law, grip_a);
  record.device_wa = input.pose_wa;
  return record;
}

/// One tick of the literal method in the same shape. It has no situation beyond "one plane" and no
/// hash.
TickRecord literal_tick(LiteralTracker& tracker, double k_f_n_per_m, const StepInput& input,
                        double t_s, std::vector<PairValue>& values) {
  tracker.update(input.pose_wa);
  for (std::size_t k = 0; k < values.size(); ++k) values[k] = {tracker.d_near_m()[k], true};
  TickRecord record;
  record.tick = input.sequence;
  record.t_s = t_s;
  record.device_wa = record.proxy_wa = input.pose_wa;
  Point force{}, torque{};
  tracker.wrench(k_f_n_per_m, force, torque);
  std::copy(force.begin(), force.end(), record.force_n);
  std::copy(torque.begin(), torque.end(), record.torque_nm);
  const std::uint32_t nearest = tracker.nearest_pair();
  record.d_near_m = values[nearest].d_near_m;
  record.in_contact = record.d_near_m <= 0;
  record.near_count = static_cast<std::uint32_t>(tracker.near_nodes(nearest).size());
  record.nodes_evaluated = static_cast<std::uint32_t>(tracker.nodes_evaluated());
  if (tracker.empty_local_sets() > 0) record.flags |= kFlagLocalSetEmpty;
  return record;
}

}  // namespace

ReplayResult replay(CoreSession& session, std::span<const MotionSample> motion,
                    const ReplayOptions& options) {
  ReplayResult result;
  result.ticks.reserve(motion.size());
  const SceneView& view = session.view();
  session.reset();
  std::optional<LiteralTracker> literal;
  if (options.literal) literal.emplace(view, *options.literal);
  std::optional<SceneOracle> oracle;
  if (options.check) oracle.emplace(view);
  std::optional<ContactLog> contacts;
  if (options.contacts && !literal) contacts.emplace(view);
  const Vec3 grip_a = grip_in_part(view);
  TrackCheck check;
  tools::SessionJudge judge(view);
  if (options.expects_contact) judge.expect_contact();
  std::vector<PairVerdict> verdicts;
  std::vector<PairValue> values(literal || oracle ? view.pair_count() : 0);
  for (std::size_t i = 0; i < motion.size(); ++i) {
    const StepInput input = input_of(motion[i], i, GoalContact::kAsked);
    const double t_s = motion[i].t_s;
    Pose goal_wa = input.pose_wa;
    if (options.tape != nullptr) options.tape->give(options.drives->input(t_s));
    if (options.drives != nullptr) options.drives->before_tick(t_s);
    TickRecord record =
        literal ? literal_tick(*literal, view.parameters().k_f_n_per_m, input, t_s, values)
                : core_tick(session, input, t_s, grip_a, goal_wa, values);
    if (literal && i == 0) record.flags |= kFlagFirstTick;
    result.ticks.push_back(record);
    if (options.drives != nullptr) options.drives->after_tick(record);
    if (!literal) judge.take(judged_tick(record));
    if (contacts && record.status == RtStatus::kOk) contacts->add(session.core(), input, t_s);
    if (oracle && record.status == RtStatus::kOk) {
      oracle->evaluate(goal_wa, verdicts);
      check.add(i, verdicts, values);
    }
    if (options.progress && (i % 256 == 0 || i + 1 == motion.size())) {
      std::fprintf(stderr, "\r%zu / %zu ticks%s", i + 1, motion.size(),
                   i + 1 == motion.size() ? "\n" : "");
    }
  }
  if (!literal) result.verdict = judge.verdict();
  if (options.check) result.check = check.totals();
  if (contacts) result.contact_csv = contacts->csv();
  return result;
}

}  // namespace haptic::sim
