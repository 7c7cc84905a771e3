// SPDX-License-Identifier: Apache-2.0
#include "tools/live/live_trace.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

namespace haptic::tools {
namespace {

/// Ticks that may be new at a look: at 8 kHz, those of 60 ms.
constexpr std::size_t kMostNew = 512;

Pose handle_in(const StepTrace& trace) {
  const double* p = trace.pose_p_m;
  const double* q = trace.pose_q_xyzw;
  return {Vec3(static_cast<Real>(p[0]), static_cast<Real>(p[1]), static_cast<Real>(p[2])),
          Quat(static_cast<Real>(q[3]), static_cast<Real>(q[0]), static_cast<Real>(q[1]),
               static_cast<Real>(q[2]))};
}

/// Finite and unit: what a servo process that goes wrong has written is not shown.
bool is_usable(const StepTrace& trace) {
  double sum = 0, square = 0;
  for (const double x : trace.pose_p_m) sum += std::abs(x);
  for (const double x : trace.pose_q_xyzw) square += x * x;
  for (const double x : trace.command_force_n) sum += std::abs(x);
  for (const double x : trace.command_torque_nm) sum += std::abs(x);
  for (const double x : trace.rendered_force_n) sum += std::abs(x);
  for (const double x : trace.rendered_torque_nm) sum += std::abs(x);
  // Comparisons with NaN are false.
  return sum < 1e6 && std::abs(square - 1) < 1e-2;
}

}  // namespace

TraceFollower::TraceFollower(std::vector<std::span<const std::byte>> recorders,
                             const WorkspaceMap& map, LiveBoard& board, const StartPlace& start)
    : recorders_(std::move(recorders)), map_(map), start_(start), writer_(board), room_(kMostNew) {}

/// The recorder with the newest tick.
std::size_t TraceFollower::at_work() {
  std::size_t newest = process_;
  std::int64_t newest_ns = std::numeric_limits<std::int64_t>::min();
  for (std::size_t k = 0; k < recorders_.size(); ++k) {
    StepTrace trace;
    if (FlightRecorder::copy_newest(recorders_[k], std::span(&trace, 1)) == 0) continue;
    if (trace.now_ns <= newest_ns) continue;
    newest_ns = trace.now_ns;
    newest = k;
  }
  return newest;
}

void TraceFollower::look() {
  const std::size_t process = at_work();
  if (process != process_) last_ = {};
  process_ = process;
  const std::size_t count = FlightRecorder::copy_newest(recorders_[process], room_);
  for (std::size_t k = 0; k < count; ++k) {
    const StepTrace& trace = room_[k];
    if (trace.tick <= last_.tick) continue;
    const bool is_report = trace.link == static_cast<std::uint8_t>(LinkState::kReady) &&
                           trace.sequence != last_.sequence && is_usable(trace);
    if (is_report) {
      const bool goes_on = last_.tick != 0 && trace.tick == last_.tick + 1 &&
                           last_.link == trace.link && trace.sequence > last_.sequence;
      take(trace, goes_on);
    }
    last_ = trace;
  }
}

void TraceFollower::take(const StepTrace& trace, bool goes_on) {
  if (begin_ns_ == 0) begin_ns_ = trace.now_ns;
  const Pose sensed_dh = handle_in(trace);
  const Vec3 arm_d = handle_arm(map_, sensed_dh.q_wa);
  if (trace.began != 0) map_ = begun_map(map_, start_, at_handle_point(sensed_dh, arm_d));
  const Pose pose = mesh_pose(map_, at_handle_point(sensed_dh, arm_d));
  LiveTick tick;
  tick.stamp_ns = trace.stamp_ns;
  for (int k = 0; k < 3; ++k) tick.p_wa_m[k] = static_cast<double>(pose.p_wa[k]);
  for (int k = 0; k < 4; ++k) tick.q_wa_xyzw[k] = static_cast<double>(pose.q_wa.coeffs()[k]);
  tick.state_hash = trace.state_hash;
  tick.sequence = trace.sequence;
  tick.marks = goes_on ? std::uint64_t{0} : std::uint64_t{kMarkReset};

  LiveState state;
  TickRecord& record = state.record;
  record.t_s = 1e-9 * static_cast<double>(trace.now_ns - begin_ns_);
  record.device_wa = record.goal_wa = record.proxy_wa = pose;
  std::copy_n(trace.rendered_force_n, 3, record.force_n);
  std::copy_n(trace.rendered_torque_nm, 3, record.torque_nm);
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  record.apart_m = record.proxy_gap_m = record.energy_j = kUnknown;
  record.d_near_m = trace.d_near_m;
  record.state_hash = trace.state_hash;
  record.situation = static_cast<ContactSituation>(trace.situation);
  record.flags = trace.step_flags;
  record.nodes_evaluated = trace.work;
  state.knows_felt = 0;
  writer_.publish(tick, state);
}

void serve_trace(LiveDoor& door, const SceneView& scene, const ServoParameters& servo,
                 std::vector<std::span<const std::byte>> recorders) {
  const auto board = std::make_unique<LiveBoard>();
  const ServoParameters of_scene = with_scene(servo, scene);
  TraceFollower follower(std::move(recorders), of_scene.map, *board, of_scene.start);
  LiveOffer offer;
  offer.scene = &scene;
  offer.board = board.get();
  offer.knows_felt = false;
  offer.before_look = [&follower] { follower.look(); };
  door.serve(std::move(offer),
             {false,
              "a device is held, whose trace has the poses of the handle and not all that the core "
              "was given; force and situation are those that ran"});
}

}  // namespace haptic::tools
