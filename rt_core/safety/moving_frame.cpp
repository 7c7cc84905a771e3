// SPDX-License-Identifier: Apache-2.0
#include "rt_core/safety/moving_frame.hpp"

#include <algorithm>
#include <cmath>

#include "rt_core/base/rotation.hpp"
#include "rt_core/base/stamp.hpp"

namespace haptic {
namespace {

constexpr Real kUnitTolerance = 1.0e-3_r;
/// A tick moves the frame by no more than this time allows, however late it is.
constexpr std::int64_t kLongestTick_ns = 20'000'000;
constexpr std::int64_t kShortestSpan_ns = 1'000'000;

bool is_pose(const Pose& pose) noexcept {
  const Real n = std::sqrt(pose.q_wa.squaredNorm());  // comparisons with NaN are false
  return is_finite(pose.p_wa) && n >= 1.0_r - kUnitTolerance && n <= 1.0_r + kUnitTolerance;
}

Pose pose_of(const FrameRecord& r) noexcept {
  const auto real = [](double x) { return static_cast<Real>(x); };
  return {Vec3(real(r.p_m[0]), real(r.p_m[1]), real(r.p_m[2])),
          Quat(real(r.q_xyzw[3]), real(r.q_xyzw[0]), real(r.q_xyzw[1]), real(r.q_xyzw[2]))};
}

/// Not negative, a second at most, for any two stamps.
std::int64_t span_between(std::int64_t from_ns, std::int64_t to_ns) noexcept {
  if (to_ns <= from_ns) return 0;
  constexpr std::uint64_t kMost_ns = 1'000'000'000;
  const std::uint64_t span =
      static_cast<std::uint64_t>(to_ns) - static_cast<std::uint64_t>(from_ns);
  return static_cast<std::int64_t>(std::min(span, kMost_ns));
}

Vec3 turn_between(const Quat& from, const Quat& to) noexcept {
  return so3_log((to * from.conjugate()).normalized());
}

/// `v`, shortened to `most`.
Vec3 shortened(const Vec3& v, Real most) noexcept {
  const Real length = robust_length(v);
  return length > most ? Vec3(v * (most / length)) : v;
}

/// Not finite and negative: 0.
Real speed_of(double stated) noexcept {
  return stated > 0 && std::isfinite(stated) ? static_cast<Real>(stated) : 0.0_r;
}

Pose turned(const Pose& from, const Vec3& way_m, const Vec3& turn_rad) noexcept {
  return {from.p_wa + way_m, (so3_exp(turn_rad) * from.q_wa).normalized()};
}

}  // namespace

// A first record is where the frame is: that it is not W is no fault of its owner's.
void MovingFrame::take(const FrameRecord& record, std::int64_t now_ns,
                       std::int64_t begin_ns) noexcept {
  const bool first = number_ == 0;
  const bool in_order = first || record.stamp_ns >= stamp_ns_;
  const std::int64_t passed_ns = first ? 0 : span_between(stamp_ns_, record.stamp_ns);
  number_ = record.number;
  late_ns_ = std::clamp<std::int64_t>(record.late_ns, 0, kLatestFrame_ns);
  stands_ = record.stands != 0;
  fastest_m_per_s_ = speed_of(record.fastest_m_per_s);
  fastest_rad_per_s_ = speed_of(record.fastest_rad_per_s);
  Pose pose = pose_of(record);
  refused_ = !is_pose(pose) || !in_order;
  if (refused_) return;
  stamp_ns_ = std::min(record.stamp_ns, now_ns);  // one from the future must not keep it fresh
  pose.q_wa.normalize();
  const Real passed_s = seconds_between(0, passed_ns);
  const bool near =
      robust_length(pose.p_wa - target_.p_wa) <= fastest_m_per_s_ * passed_s + kFrameFloor_m &&
      robust_length(turn_between(target_.q_wa, pose.q_wa)) <=
          fastest_rad_per_s_ * passed_s + kFrameFloor_rad;
  start_ = now_;
  target_ = pose;
  // An owner no faster than stated is never farther ahead than what he may move until he is late.
  const Real late_s = seconds_between(0, late_ns_);
  const bool followed =
      robust_length(target_.p_wa - now_.p_wa) <= fastest_m_per_s_ * late_s + 2 * kFrameFloor_m &&
      robust_length(turn_between(now_.q_wa, target_.q_wa)) <=
          fastest_rad_per_s_ * late_s + 2 * kFrameFloor_rad;
  lost_ = lost_ || !near || !followed;
  begin_ns_ = begin_ns;
  span_ns_ = std::clamp(passed_ns, kShortestSpan_ns, std::max(kShortestSpan_ns, late_ns_));
}

void MovingFrame::go_on(std::int64_t passed_ns, std::int64_t now_ns) noexcept {
  const std::int64_t gone_ns = std::min(span_between(begin_ns_, now_ns), span_ns_);
  const Real share = static_cast<Real>(gone_ns) / static_cast<Real>(span_ns_);
  const Pose wanted = turned(start_, share * (target_.p_wa - start_.p_wa),
                             share * turn_between(start_.q_wa, target_.q_wa));
  const Real passed_s = seconds_between(0, passed_ns);
  const Vec3 way_m = shortened(wanted.p_wa - now_.p_wa, fastest_m_per_s_ * passed_s);
  const Vec3 turn_rad =
      shortened(turn_between(now_.q_wa, wanted.q_wa), fastest_rad_per_s_ * passed_s);
  now_ = turned(now_, way_m, turn_rad);
  if (passed_ns > 0) twist_w_ = {way_m / passed_s, turn_rad / passed_s};
}

bool MovingFrame::follow(const FrameRecord& newest, std::int64_t now_ns, bool felt) noexcept {
  jumped_ = false;
  const std::int64_t passed_ns =
      last_ns_ == 0 ? 0 : std::min(span_between(last_ns_, now_ns), kLongestTick_ns);
  last_ns_ = now_ns;
  twist_w_ = Twist{};
  // 0 after others: the owner has fallen silent, and the frame is not W for that.
  if (newest.number != 0 && newest.number != number_) take(newest, now_ns, now_ns - passed_ns);
  if (!is_used()) return false;
  const bool late = !stands_ && span_between(stamp_ns_, now_ns) > late_ns_;
  const bool cause = refused_ || late;
  lost_ = lost_ || cause;
  if (!lost_) {
    go_on(passed_ns, now_ns);
  } else if (!cause && !felt) {
    now_ = start_ = target_;
    begin_ns_ = now_ns;
    lost_ = false;
    jumped_ = true;
  }
  return lost_;
}

Pose MovingFrame::inside(const Pose& pose_wa) const noexcept {
  const Quat back = now_.q_wa.conjugate();
  return {back * (pose_wa.p_wa - now_.p_wa), (back * pose_wa.q_wa).normalized()};
}

Twist MovingFrame::inside(const Twist& twist_w, const Vec3& at_w) const noexcept {
  const Quat back = now_.q_wa.conjugate();
  const Vec3 carried = twist_w_.linear_w + twist_w_.angular_w.cross(at_w - now_.p_wa);
  return {back * (twist_w.linear_w - carried), back * (twist_w.angular_w - twist_w_.angular_w)};
}

Wrench MovingFrame::inside(const Wrench& wrench_w) const noexcept {
  const Quat back = now_.q_wa.conjugate();
  return {back * wrench_w.force_w, back * wrench_w.torque_w};
}

Wrench MovingFrame::outside(const Wrench& wrench_f) const noexcept {
  return {now_.q_wa * wrench_f.force_w, now_.q_wa * wrench_f.torque_w};
}

}  // namespace haptic
