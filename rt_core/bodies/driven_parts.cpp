// SPDX-License-Identifier: Apache-2.0
#include "rt_core/bodies/driven_parts.hpp"

#include <algorithm>
#include <cmath>

#include "rt_core/base/rotation.hpp"
#include "rt_core/base/stamp.hpp"
#include "rt_core/law/coupling.hpp"

namespace haptic {
namespace {

/// A step makes up for no more time than this, however long ago the last one was.
constexpr Real kLongestStep_s = 0.02_r;
/// Nearer than this, and in no need of a bound, it is where its owner has it.
constexpr Real kArrived_m = 1.0e-6_r, kArrived_rad = 1.0e-6_r;

Vec3 middle_of(const DrivenRecord& record) noexcept {
  return {static_cast<Real>(record.middle_m[0]), static_cast<Real>(record.middle_m[1]),
          static_cast<Real>(record.middle_m[2])};
}

/// The tighter of what the owner states with a pose, 0: nothing, and what the scene does.
double tighter(double given, double stated) noexcept {
  return given > 0 ? std::min(given, stated) : stated;
}

FrameRecord within(FrameRecord given, const DrivenRecord& record) noexcept {
  given.fastest_m_per_s = tighter(given.fastest_m_per_s, record.fastest_m_per_s);
  given.fastest_rad_per_s = tighter(given.fastest_rad_per_s, record.fastest_rad_per_s);
  const auto late_ns = static_cast<std::int64_t>(1e9 * record.late_s);
  given.late_ns = given.late_ns > 0 ? std::min(given.late_ns, late_ns) : late_ns;
  return given;
}

Real size(const Vec3& v) noexcept { return std::sqrt(v.squaredNorm()); }

}  // namespace

void DrivenParts::begin(std::span<const DrivenRecord> records,
                        std::span<const Pose> starts) noexcept {
  records_ = records.first(std::min<std::size_t>(records.size(), kMostDriven));
  last_ns_ = 0;
  for (std::uint32_t k = 0; k < count(); ++k) {
    frames_[k] = MovingFrame();
    frames_[k].begin_at(starts[k]);
    states_[k] = DrivenState();
    states_[k].commanded_wa = states_[k].felt_wa = starts[k];
    reach_[k] = Reach();
  }
}

std::uint32_t DrivenParts::follow(const DrivenInput& input) noexcept {
  const Real passed_s =
      last_ns_ == 0 || input.now_ns <= last_ns_ ? 0 : seconds_between(last_ns_, input.now_ns);
  last_ns_ = input.now_ns;
  std::uint32_t released = 0;
  for (std::uint32_t k = 0; k < count(); ++k) {
    if (records_[k].lead != Lead::kOwner) continue;
    DrivenState& state = states_[k];
    MovingFrame& frame = frames_[k];
    const FrameRecord given = k < input.newest.size() ? input.newest[k] : FrameRecord{};
    const bool is_felt = input.is_felt && state.touches();
    state.is_lost = frame.follow(within(given, records_[k]), input.now_ns, is_felt);
    state.commanded_wa = frame.pose();
    if (state.is_lost) released |= state.touched_by;
    Reach& reach = reach_[k];
    const auto more = [&](Real& left, double fastest) {
      const Real speed = kCatchUp * static_cast<Real>(fastest);
      left = std::min(left + speed * passed_s, speed * kLongestStep_s);
    };
    more(reach.way_m, records_[k].fastest_m_per_s);
    more(reach.turn_rad, records_[k].fastest_rad_per_s);
  }
  return released;
}

GripPose DrivenParts::grip_of(std::uint32_t k, const Pose& pose_wa) const noexcept {
  GripPose grip;
  grip.q_wa = pose_wa.q_wa;
  grip.r_wa = pose_wa.q_wa.toRotationMatrix();
  grip.x0_w = pose_wa.p_wa + grip.r_wa * middle_of(records_[k]);
  return grip;
}

GripPose DrivenParts::felt(std::uint32_t k) const noexcept {
  return grip_of(k, states_[k].felt_wa);
}

GripPose DrivenParts::goal(std::uint32_t k) const noexcept {
  GripPose goal = grip_of(k, states_[k].commanded_wa);
  const DrivenRecord& record = records_[k];
  // In a tick, which is late_s long.
  if (record.lead == Lead::kWeight)
    goal.x0_w.z() -= static_cast<Real>(record.fastest_m_per_s * record.late_s);
  if (record.lead != Lead::kOwner) return goal;
  const GripPose from = felt(k);
  const PoseError error = pose_error(goal, from);
  const Real far_m = size(error.translation_m), turn_rad = size(error.rotation_rad);
  const Reach& reach = reach_[k];
  if (far_m <= reach.way_m + kArrived_m && turn_rad <= reach.turn_rad + kArrived_rad) return goal;
  const auto share = [](Real whole, Real most) { return whole > most ? most / whole : Real{1}; };
  return moved(from, share(far_m, reach.way_m) * error.translation_m,
               share(turn_rad, reach.turn_rad) * error.rotation_rad);
}

void DrivenParts::take(std::uint32_t k, const GripPose& felt, const Wrench& pushed_w,
                       std::uint32_t touched_by) noexcept {
  DrivenState& state = states_[k];
  const Vec3 middle_w = felt.r_wa * middle_of(records_[k]);
  const GripPose commanded = grip_of(k, state.commanded_wa);
  const bool arrived = felt.x0_w == commanded.x0_w && felt.q_wa.coeffs() == commanded.q_wa.coeffs();
  state.felt_wa = arrived ? state.commanded_wa : Pose{felt.x0_w - middle_w, felt.q_wa};
  const PoseError error = pose_error(commanded, felt);
  state.lag_m = size(error.translation_m);
  state.lag_rad = size(error.rotation_rad);
  state.pushed_w = {pushed_w.force_w, pushed_w.torque_w + middle_w.cross(pushed_w.force_w)};
  state.touched_by = touched_by;
  reach_[k] = Reach();
}

void DrivenParts::give_way(std::uint32_t k, Real most_m, Real most_rad) noexcept {
  DrivenState& state = states_[k];
  if (records_[k].lead == Lead::kOwner) return;
  const bool sinks = records_[k].lead == Lead::kWeight;
  const GripPose at = felt(k);
  const PoseError error = pose_error(grip_of(k, state.commanded_wa), at);
  const Real far_m = size(error.translation_m), turn_rad = size(error.rotation_rad);
  if (!sinks && far_m <= most_m && turn_rad <= most_rad) return;
  const auto kept = [&](Real whole, Real most) {
    return sinks ? Real{0} : whole > most ? most / whole : Real{1};
  };
  const GripPose anchor = moved(at, kept(far_m, most_m) * error.translation_m,
                                kept(turn_rad, most_rad) * error.rotation_rad);
  state.commanded_wa = {anchor.x0_w - anchor.r_wa * middle_of(records_[k]), anchor.q_wa};
}

void DrivenParts::rest(std::uint32_t k) noexcept {
  states_[k].pushed_w = Wrench{};
  states_[k].touched_by = 0;
}

void DrivenParts::pass(std::uint32_t k) noexcept {
  if (records_[k].lead != Lead::kOwner) return;
  DrivenState& state = states_[k];
  state.felt_wa = state.commanded_wa;
  state.lag_m = state.lag_rad = 0;
  state.pushed_w = Wrench{};
  state.touched_by = 0;
  reach_[k] = Reach();
}

}  // namespace haptic
