// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/stability/stability_trial.hpp"

#include <algorithm>
#include <cmath>

#include "host_sim/device/loop_run.hpp"
#include "host_sim/shapes/contact_case.hpp"
#include "host_sim/shapes/shapes.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

constexpr double kDepth_m = 2.0e-3, kOff_m = 1.0e-4;
constexpr double kCubeHalf_m = 0.010, kWallHalf_m = 0.050;
constexpr double kLost = 0.6;  ///< share of the depth: farther off, the linear wall is left
constexpr int kGuideTicks = 200;
constexpr double kBlock_s = 0.1;
constexpr std::size_t kReferenceBlock = 2;  ///< what the hand damps at once is gone by then
constexpr double kGrown = 9.0, kGone = 1.0e-5;

constexpr double kClearance_m = 1.0e-4;
constexpr double kPegMotion_s = 1.0;
/// Close to the boundary a stable loop takes long to settle: what still falls is waited for.
constexpr int kPegStages = 8;
constexpr double kFalls = 0.9;
/// Faster than any trial that comes to rest.
constexpr double kRunaway_m_per_s = 20.0;

SceneParameters scene_parameters(const TrialSetting& setting, double stiffness_n_per_m) {
  SceneParameters p = tools::default_parameters();
  set_trial(p, setting, stiffness_n_per_m);
  return p;
}

HandModel hand_of_setting(const TrialSetting& setting) {
  const std::optional<HandModel> hand = hand_named(setting.hand);
  if (!hand) throw tools::InputError("no hand is called '" + setting.hand + "'");
  return *hand;
}

DeviceModel device_of_setting(const TrialSetting& setting) {
  DeviceModel model;
  model.delay_samples = setting.delay_samples;
  return model;
}

std::vector<std::byte> cube_on_wall(const TrialSetting& setting, double stiffness_n_per_m) {
  const Solid cube = centred_box("cube", kCubeHalf_m, kCubeHalf_m, kCubeHalf_m);
  const Solid wall = centred_box("wall", 0.1, 0.1, kWallHalf_m);
  return scene_with(cube, {&wall, 1}, scene_parameters(setting, stiffness_n_per_m));
}

}  // namespace

void set_trial(SceneParameters& p, const TrialSetting& setting, double stiffness_n_per_m) {
  p.law = setting.law;
  p.rate_hz = setting.rate_hz;
  p.k_f_n_per_m = stiffness_n_per_m;
  CouplingParameters& c = p.coupling;
  c.k_t_n_per_m = stiffness_n_per_m;
  c.k_r_nm_per_rad = stiffness_n_per_m * kGripRadius_m * kGripRadius_m;
  c.damping_ns_per_m = setting.damping_ns_per_m;
  c.damping_share = 1.0;
  c.max_rotation_error_rad = 0.3;
  c.max_window_s = 0.02;
  // Bare: what is sought is where the loop alone stops being stable.
  c.passivity = 0;
  c.allow_active = 1;
}

bool law_served(LawId law) {
  TrialSetting setting;
  setting.law = law;
  try {
    CoreSession session(cube_on_wall(setting, 1000), "wall");
    return true;
  } catch (const tools::InputError&) {
    return false;
  }
}

LinearLoop linear_loop(const TrialSetting& setting) {
  const DeviceModel device = device_of_setting(setting);
  const HandModel hand = hand_of_setting(setting);
  LinearLoop loop;
  loop.mass_kg = device.mass_kg;
  loop.damping_ns_per_m = device.damping_ns_per_m;
  loop.hand_stiffness = hand.stiffness_n_per_m;
  loop.hand_damping = hand.damping_ns_per_m;
  loop.period_s = 1 / setting.rate_hz;
  loop.delay_samples = setting.delay_samples;
  return loop;
}

bool wall_is_stable(const TrialSetting& setting, double stiffness_n_per_m, double seconds) {
  CoreSession session(cube_on_wall(setting, stiffness_n_per_m), "wall");
  HandModel hand = hand_of_setting(setting);
  hand.push_w = Vector(0, 0, -stiffness_n_per_m * kDepth_m);
  const DeviceModel device = device_of_setting(setting);
  ClosedLoop loop(session, device, hand, setting.rate_hz);
  const Vector rest(0, 0, kWallHalf_m + kCubeHalf_m - kDepth_m);
  const HandStroke stroke{{rest, Rotation::Identity()}, {rest, Rotation::Identity()}};
  const auto held = [&](double height_m) {
    return DeviceState{rest + Vector(0, 0, height_m), Rotation::Identity(), Vector::Zero(),
                       Vector::Zero()};
  };
  // From outside to where it is let go, and there until the damping's window has forgotten the way.
  loop.place(held(2 * kDepth_m));
  for (int k = 0; k <= kGuideTicks; ++k) {
    const double way = std::min(1.0, 2.0 * k / kGuideTicks);
    loop.guide(held(2 * kDepth_m + way * (kOff_m - 2 * kDepth_m)));
  }

  const auto block_ticks = static_cast<std::size_t>(std::llround(kBlock_s * setting.rate_hz));
  const auto blocks = static_cast<std::size_t>(std::llround(seconds / kBlock_s));
  const double spring = stiffness_n_per_m + hand.stiffness_n_per_m;
  const double at_first = spring * kOff_m * kOff_m;
  double reference = 0, energy = 0;
  for (std::size_t block = 0; block < blocks; ++block) {
    energy = 0;
    for (std::size_t k = 0; k < block_ticks; ++k) {
      const LoopTick tick = loop.step(stroke);
      const double off = (tick.device.x0_w - rest).norm();
      if (!(off < kLost * kDepth_m)) return false;
      energy += spring * off * off + device.mass_kg * tick.device.velocity_w.squaredNorm();
    }
    energy /= static_cast<double>(block_ticks);
    if (block == kReferenceBlock) reference = energy;
    if (energy < kGone * at_first) return true;
    if (block > kReferenceBlock && energy > kGrown * reference) return false;
  }
  return energy <= reference;
}

double wall_limit(const TrialSetting& setting, double guess, double seconds) {
  constexpr double kWiden = 1.4, kLargestRatio = 32, kWithin = 1.0005;
  double low = guess / kWiden, high = guess * kWiden;
  while (!wall_is_stable(setting, low, seconds)) {
    high = low;
    low /= kWiden;
    if (guess / low > kLargestRatio) return 0;
  }
  while (wall_is_stable(setting, high, seconds)) {
    low = high;
    high *= kWiden;
    if (high / guess > kLargestRatio) return kNoLimit;
  }
  while (high > kWithin * kWithin * low) {
    const double middle = std::sqrt(low * high);
    (wall_is_stable(setting, middle, seconds) ? low : high) = middle;
  }
  return std::sqrt(low * high);
}

const std::vector<double>& peg_stiffnesses() {
  static const std::vector<double> list = {500, 700, 1000, 1400, 2000, 3000, 4000, 5000};
  return list;
}

PegRest peg_rest(const TrialSetting& setting, double stiffness_n_per_m, double seconds) {
  const Solid peg = square_peg();
  const std::vector<Solid> hole = five_piece_hole(kCubeHalf_m + kClearance_m);
  CoreSession session(scene_with(peg, hole, scene_parameters(setting, stiffness_n_per_m)), "peg");
  return peg_rest_in(session, setting, seconds, {});
}

PegRest peg_rest_in(CoreSession& session, const TrialSetting& setting, double seconds,
                    const PegHold& hold) {
  ClosedLoop loop(session, device_of_setting(setting), hand_of_setting(setting), setting.rate_hz);
  const Vector start(0, 0, kPegHalfLength_m - hold.depth_m);
  const auto target = [&](double t_s) {
    const double u = std::min(1.0, t_s / kPegMotion_s);
    const double way = u * u * u * (10 + u * (6 * u - 15));  // minimum jerk
    return HandTarget{start + way * Vector(0.003, 0.002, 0),
                      rotation_of(way * Vector(0.02, 0.05, 0))};
  };
  loop.place({start, Rotation::Identity(), Vector::Zero(), Vector::Zero()});
  const auto in_ticks = [&](double t_s) {
    return static_cast<std::size_t>(std::llround(t_s * setting.rate_hz));
  };
  const std::size_t watched = in_ticks(0.1 * (kPegMotion_s + seconds));
  PegRest rest;
  std::size_t k = 0;
  for (int stage = 1; stage <= kPegStages; ++stage) {
    const PegRest before = rest;
    rest = {0, 0, stage * seconds, true, before.off_m};
    const std::size_t end = in_ticks(kPegMotion_s + rest.rest_s);
    for (; k < end; ++k) {
      const double t_s = static_cast<double>(k) * loop.period_s();
      const LoopTick tick = loop.step({target(t_s), target(t_s + loop.period_s())});
      const double speed = tick.device.velocity_w.norm(),
                   turn = tick.device.angular_velocity_w.norm();
      rest.off_m = std::max(rest.off_m, std::abs(tick.device.x0_w.z() - start.z()));
      rest.in_place = rest.off_m < hold.thrown_m;
      if (!(speed < kRunaway_m_per_s) || !rest.in_place)
        return {speed, turn, rest.rest_s, false, rest.off_m};
      if (k + watched < end) continue;
      rest.speed_m_per_s = std::max(rest.speed_m_per_s, speed);
      rest.turn_rad_per_s = std::max(rest.turn_rad_per_s, turn);
    }
    // What is at rest already may wander at rounding.
    const bool falls =
        stage == 1 ||
        ((rest.slow() || rest.speed_m_per_s <= kFalls * before.speed_m_per_s) &&
         (rest.turns_slowly() || rest.turn_rad_per_s <= kFalls * before.turn_rad_per_s));
    if (rest.at_rest() || !falls) break;
  }
  return rest;
}

PegLimit peg_limit(const TrialSetting& setting, double seconds) {
  PegLimit limit;
  for (const double stiffness : peg_stiffnesses()) {
    const PegRest rest = peg_rest(setting, stiffness, seconds);
    if (!rest.at_rest()) break;
    limit = {stiffness, rest.rest_s};
  }
  return limit;
}

}  // namespace haptic::sim
