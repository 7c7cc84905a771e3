// SPDX-License-Identifier: Apache-2.0
#include "rt_core/tick/guide.hpp"

#include <algorithm>
#include <cmath>

namespace haptic {
namespace {

/// Share of let_go_m over which the force fades.
constexpr Real kFade = 0.25_r;
/// The hold grows to its largest over about this share of let_go_m: with the defaults its stiffness
/// is 5 N over turn_m, which a device holds that is sampled late.
constexpr Real kHoldWidth = 0.4_r;
/// The hold begins at this share of the clearance, so that the part is led back before it touches.
constexpr Real kInside = 0.4_r;
/// The pull has fallen to a half where the part is off by so much more, in shares of the clearance
/// and of let_go_m at the least: a part that is not lined up yet is led to the way, not pressed on
/// along it, where on the rim of a hole the pull would tip it away.
constexpr Real kLinedUp = 0.1_r, kLeastLinedUp = 0.001_r;
/// A part nearer to a station than this share of its clearance can go straight there: no point of
/// it moves by more than the sum of place and turn, which is at most sqrt(2) times their root of
/// squares, and rounding.
constexpr Real kStraightShare = 0.7_r;
/// With less energy left than this share of what is stated, or than the force does over this way in
/// a tick, the force falls with it.
constexpr Real kLowShare = 0.05_r, kLowWay_m = 5.0e-3_r;

/// The share of `sum` in `acted`, 0 to 1.
Real share_of(const Vec3& acted, const Vec3& sum) noexcept {
  const Real square = sum.squaredNorm();
  return square > 0 ? std::clamp(acted.dot(sum) / square, 0.0_r, 1.0_r) : 0.0_r;
}

/// Twice the vector part of the quaternion from `from` to `to`, by the shorter way: the turn
/// between them, as long as it is small [rad].
Vec3 chord(const Quat& from, const Quat& to) noexcept {
  const Vec3 v = to.vec() * from.w() - from.vec() * to.w() - to.vec().cross(from.vec());
  return to.coeffs().dot(from.coeffs()) < 0 ? Vec3(-2 * v) : Vec3(2 * v);
}

}  // namespace

void GuideStage::read_scene(const SceneView& scene) noexcept {
  const GuideRecord& g = *scene.guide();
  stations_ = scene.guide_stations();
  pull_n_ = static_cast<Real>(g.pull_n);
  hold_n_ = static_cast<Real>(g.hold_n);
  turn_m_ = static_cast<Real>(g.turn_m);
  near_goal_m_ = static_cast<Real>(g.near_goal_m);
  let_go_m_ = static_cast<Real>(g.let_go_m);
  gain_step_ = static_cast<Real>(std::min(1.0, 1.0 / (g.ramp_s * scene.parameters().rate_hz)));
  most_j_ = static_cast<Real>(g.energy_j);
  low_j_ = std::max(kLowShare * most_j_, kLowWay_m * (pull_n_ + hold_n_));
  reset();
}

void GuideStage::reset() noexcept {
  // The account is not renewed: what has been done stays done.
  if (!told_) energy_j_ = most_j_;
  told_ = true;
  gain_ = 0;
  lined_ = 1;
  segment_ = search_ = 0;
  on_ = has_device_ = false;
  contact_w_ = last_w_ = acted_w_ = Wrench{};
}

Wrench GuideStage::take_share(const Wrench& acted, bool valid) noexcept {
  acted_w_ = last_w_;
  const Wrench sum{contact_w_.force_w + last_w_.force_w, contact_w_.torque_w + last_w_.torque_w};
  if (!valid || (acted.force_w == sum.force_w && acted.torque_w == sum.torque_w)) {
    return contact_w_;
  }
  acted_w_.force_w = share_of(acted.force_w, sum.force_w) * last_w_.force_w;
  acted_w_.torque_w = share_of(acted.torque_w, sum.torque_w) * last_w_.torque_w;
  return {acted.force_w - acted_w_.force_w, acted.torque_w - acted_w_.torque_w};
}

GuideStage::Offset GuideStage::offset_from(const GuideStation& station,
                                           const GripPose& pose) const noexcept {
  const Real* const q = station.q_wa_xyzw;
  return {pose.x0_w - ConstVec3Map(station.x0_m),
          turn_m_ * chord(Quat(q[3], q[0], q[1], q[2]), pose.q_wa)};
}

/// What the last wrench has done since.
void GuideStage::account(const GripPose& device) noexcept {
  if (has_device_) {
    const Real work_j = acted_w_.force_w.dot(device.x0_w - device_.x0_w) +
                        acted_w_.torque_w.dot(chord(device_.q_wa, device.q_wa));
    energy_j_ = std::min(energy_j_ - work_j, most_j_);
  }
  device_ = device;
  has_device_ = true;
}

void GuideStage::look_for_station(const GripPose& felt) noexcept {
  for (std::uint32_t k = 0; k < kGuideSearch && !on_; ++k) {
    const GuideStation& station = stations_[search_];
    const Real room_m = kStraightShare * std::min(station.clearance_m, let_go_m_);
    if (offset_from(station, felt).square() <= room_m * room_m) {
      on_ = true;
      segment_ = std::min(search_, static_cast<std::uint32_t>(stations_.size()) - 2);
    }
    search_ = search_ + 1 < stations_.size() ? search_ + 1 : 0;
  }
}

/// The last wrench fades with the gain; with no energy left it ends.
void GuideStage::fade_out() noexcept {
  const Real next = energy_j_ > 0 ? std::max(gain_ - gain_step_, 0.0_r) : 0.0_r;
  const Real share = gain_ > 0 ? next / gain_ : 0.0_r;
  last_w_ = {share * last_w_.force_w, share * last_w_.torque_w};
  gain_ = next;
}

Guidance GuideStage::update(const GripPose& felt, const GripPose& device, const Wrench& contact_w,
                            bool wanted) noexcept {
  account(device);
  contact_w_ = contact_w;
  Guidance result;
  result.stations = static_cast<std::uint32_t>(stations_.size());
  result.energy_j = energy_j_;
  result.state = wanted ? GuideState::kLost : GuideState::kOff;
  if (!wanted) on_ = false;
  // What is found leads from the next tick on: a tick looks for a station or is led, not both.
  const bool leads = on_;
  if (wanted && !on_) look_for_station(felt);
  if (!leads) {
    fade_out();
    result.wrench_w = last_w_;
    return result;
  }

  // The nearest place on the segments about the last one.
  const auto last_segment = static_cast<std::uint32_t>(stations_.size()) - 2;
  const std::uint32_t first = segment_ > 0 ? segment_ - 1 : 0;
  Offset off{Vec3::Zero(), Vec3::Zero()}, along = off;
  Real least2 = 0, place = 0, inverse = 0;
  for (std::uint32_t k = 0; k < kGuideWindow && first + k <= last_segment; ++k) {
    const GuideStation& station = stations_[first + k];
    const Offset way{ConstVec3Map(station.way_m), ConstVec3Map(station.turn_way_m)};
    Offset here = offset_from(station, felt);
    const Real s = std::clamp(
        (here.place_m.dot(way.place_m) + here.turn_m.dot(way.turn_m)) * station.per_square, 0.0_r,
        1.0_r);
    here.place_m -= s * way.place_m;
    here.turn_m -= s * way.turn_m;
    const Real square = here.square();
    if (k > 0 && !(square < least2)) continue;
    least2 = square;
    off = here;
    along = way;
    place = s;
    inverse = station.per_square;
    segment_ = first + k;
  }
  // Past the end of a segment, and not nearer to any place of the next one: the round of a corner,
  // where the cost is the same everywhere. The way goes on along the next segment; along the last
  // one the pull would press on past the corner, into what the way turns away from.
  if (!(place < 1) && segment_ < last_segment) {
    const GuideStation& corner = stations_[++segment_];
    place = 0;
    along = {ConstVec3Map(corner.way_m), ConstVec3Map(corner.turn_way_m)};
    inverse = corner.per_square;
  }
  const GuideStation& from = stations_[segment_];
  const GuideStation& to = stations_[segment_ + 1];
  result.station = segment_ + (place < 1 ? 0u : 1u);
  result.contacts = to.contacts;
  result.cost_m = (1 - place) * from.cost_m + place * to.cost_m;
  const Real off_m = result.off_m = std::sqrt(least2);
  if (!(off_m < let_go_m_)) {
    on_ = false;
    fade_out();
    result.wrench_w = last_w_;
    return result;
  }
  result.state = GuideState::kOn;
  gain_ = std::min(gain_ + gain_step_, 1.0_r);

  // U = pull (sqrt(c^2 + c0^2) - c0) + hold (sqrt(w^2 + d^2) - w), d the distance beyond a share of
  // the clearance. Its slope along the way times l^2 / (l^2 + d^2), as a mean over the time of the
  // ramp: followed at once, so steep a change would be a stiff spring in the loop.
  const Real cost = result.cost_m;
  const Real clear = (1 - place) * from.clearance_m + place * to.clearance_m;
  const Real beyond = std::max(off_m - kInside * clear, 0.0_r), width = kHoldWidth * let_go_m_;
  const Real narrow = std::max(kLinedUp * clear, kLeastLinedUp * let_go_m_);
  lined_ += gain_step_ * (narrow * narrow / (narrow * narrow + beyond * beyond) - lined_);
  const Real pull = lined_ * pull_n_ * cost / std::sqrt(cost * cost + near_goal_m_ * near_goal_m_) *
                    std::sqrt(inverse);
  const Real hold =
      off_m > 0 ? hold_n_ * beyond / (std::sqrt(beyond * beyond + width * width) * off_m) : 0.0_r;
  const Real fade = std::min((let_go_m_ - off_m) / (kFade * let_go_m_), 1.0_r);
  const Real left = std::clamp(energy_j_ / low_j_, 0.0_r, 1.0_r);
  const Real gain = gain_ * fade * left;
  last_w_.force_w = gain * (pull * along.place_m - hold * off.place_m);
  last_w_.torque_w = gain * turn_m_ * (pull * along.turn_m - hold * off.turn_m);
  result.wrench_w = last_w_;
  return result;
}

}  // namespace haptic
