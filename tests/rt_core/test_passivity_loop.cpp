// SPDX-License-Identifier: Apache-2.0
// A hand presses into a wall, holds and withdraws: the layer over play and adaptive window
// (rt_core/METHOD.md section 9.2). 0.1 kg, 1 N s/m, 1 ms.

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "rt_core/base/encoder_play.hpp"
#include "rt_core/base/rotation.hpp"
#include "rt_core/base/twist_estimator.hpp"
#include "rt_core/safety/passivity.hpp"

using namespace haptic;

namespace {

constexpr double kMass_kg = 0.1, kDamping = 1.0, kPeriod_s = 1.0e-3, kLever_m = 0.05;
constexpr int kPressTicks = 500, kHoldTicks = 2000, kOutTicks = 300, kSubsteps = 40;
constexpr double kPress_m = 0.008, kStart_m = -0.002;

struct Hand {
  double stiffness, damping;
};
constexpr Hand kLoose{100, 0.2}, kLight{300, 3}, kFirm{800, 10};

struct Press {
  double wall_n_per_m = 1000;
  int delay = 0;  // samples, at most 1
  double encoder_m = 0;
  Hand hand = kLight;
  bool layer = true;
  bool angular = false;  // the same loop as a turn: every quantity times the lever or its square
};

struct Felt {
  double rest_pp_n = 0;  // over the last half second of the hold
  int free_ticks = 0;    // with a force outside the wall
  double pull_n = 0;
  std::vector<double> forces;
};

double target_m(double tick) {
  const double press = kPress_m - kStart_m, held = kPressTicks + kHoldTicks;
  if (tick < held) return kStart_m + press * std::min(1.0, tick / kPressTicks);
  return std::max(kStart_m, kPress_m - 0.1 * kPeriod_s * (tick - held));
}

Felt press(const Press& p) {
  const Real step = static_cast<Real>(p.encoder_m);
  const Real step_rad = step / static_cast<Real>(kLever_m);
  EncoderPlay play(step, step_rad);
  TwistWindow window;
  window.step_m = step;
  window.step_rad = step_rad;
  TwistEstimator estimator(window);
  PassivityLimits limits;
  limits.mass_kg = static_cast<Real>(kMass_kg);
  limits.damping_ns_per_m = static_cast<Real>(kDamping);
  limits.rotor_kg_m2 = limits.mass_kg * static_cast<Real>(kLever_m * kLever_m);
  limits.rotor_damping_nms_per_rad =
      limits.damping_ns_per_m * static_cast<Real>(kLever_m * kLever_m);
  limits.noise_j = static_cast<Real>(0.5 * p.wall_n_per_m * p.encoder_m * p.encoder_m);
  Passivity passivity(limits);
  Felt felt;
  double x = kStart_m, v = 0, acting_n = 0, waiting_n = 0, low = 1e9, high = -1e9;
  for (int tick = 0; tick < kPressTicks + kHoldTicks + kOutTicks; ++tick) {
    const double seen_m = p.encoder_m > 0 ? p.encoder_m * std::floor(x / p.encoder_m + 0.5) : x;
    Vec3 grip = Vec3::Zero();
    Quat q = Quat::Identity();
    if (p.angular) {
      q = so3_exp(Vec3(0, static_cast<Real>(seen_m / kLever_m), 0));
    } else {
      grip.y() = static_cast<Real>(seen_m);
    }
    const PlayedPose played = play.update(grip, q);
    const std::int64_t stamp_ns = std::int64_t{1'000'000} * tick;
    const TwistEstimate twist = estimator.update({stamp_ns, played.grip_w, played.q_wa, {}, false});
    const double played_m =
        seen_m - (p.angular ? kLever_m * static_cast<double>(played.ahead_rad.y())
                            : static_cast<double>(played.ahead_m.y()));
    const double wall_n = -p.wall_n_per_m * std::max(0.0, seen_m);
    const double stored_j =
        0.5 * p.wall_n_per_m * std::max(0.0, played_m) * std::max(0.0, played_m);
    PassivityInput in;
    in.stamp_ns = stamp_ns;
    in.way_m = played.way_m;
    in.turn_rad = played.turn_rad;
    in.twist_w = twist.twist_w;
    in.twist_valid = twist.valid;
    in.stores = true;
    in.accepted_valid = true;
    if (p.angular) {
      in.stored.angular_j = stored_j;
      in.command_w.torque_w.y() = static_cast<Real>(wall_n * kLever_m);
      in.accepted_w.torque_w.y() = static_cast<Real>(acting_n * kLever_m);
    } else {
      in.stored.linear_j = stored_j;
      in.command_w.force_w.y() = static_cast<Real>(wall_n);
      in.accepted_w.force_w.y() = static_cast<Real>(acting_n);
    }
    const Wrench out = p.layer ? passivity.update(in).wrench_w : in.command_w;
    const double output_n = p.angular ? static_cast<double>(out.torque_w.y()) / kLever_m
                                      : static_cast<double>(out.force_w.y());
    felt.forces.push_back(output_n);
    felt.free_ticks += seen_m <= 0 && output_n != 0 ? 1 : 0;
    felt.pull_n = std::max(felt.pull_n, output_n);
    if (tick >= kPressTicks + kHoldTicks - 500 && tick < kPressTicks + kHoldTicks) {
      low = std::min(low, output_n);
      high = std::max(high, output_n);
    }
    acting_n = p.delay > 0 ? waiting_n : output_n;
    waiting_n = output_n;
    const double from = target_m(tick), speed = (target_m(tick + 1) - from) / kPeriod_s;
    for (int i = 0; i < kSubsteps; ++i) {
      const double h = kPeriod_s / kSubsteps;
      v += h / kMass_kg *
           (acting_n - kDamping * v + p.hand.stiffness * (from + speed * i * h - x) +
            p.hand.damping * (speed - v));
      x += h * v;
    }
  }
  felt.rest_pp_n = high - low;
  return felt;
}

}  // namespace

TEST_SUITE("rt_core.passivity_loop") {
  TEST_CASE("nothing in free space, never a pull, at any stiffness, delay, encoder and hand") {
    for (const bool angular : {false, true}) {
      for (const double k : {1000.0, 2000.0, 5000.0}) {
        for (const int delay : {0, 1}) {
          for (const double encoder_m : {0.0, 1.0e-6, 1.0e-5, 6.0e-5}) {
            for (const Hand& hand : {kLoose, kLight, kFirm}) {
              const Felt felt = press({k, delay, encoder_m, hand, true, angular});
              CAPTURE(k);
              CAPTURE(delay);
              CAPTURE(encoder_m);
              CAPTURE(hand.stiffness);
              REQUIRE(felt.free_ticks == 0);
              REQUIRE(felt.pull_n <= 1.0e-6);
            }
          }
        }
      }
    }
  }

  TEST_CASE(
      "within K T (1/2 + d) < b: the bits of the run without, and at most 1.5 counts at rest") {
    for (const double encoder_m : {0.0, 1.0e-6, 1.0e-5, 6.0e-5}) {
      for (const Hand& hand : {kLoose, kLight, kFirm}) {
        Press p{1000, 0, encoder_m, hand, true, false};
        const Felt with = press(p);
        p.layer = false;
        CAPTURE(encoder_m);
        CAPTURE(hand.stiffness);
        CHECK(with.forces == press(p).forces);
        CHECK(with.rest_pp_n <= 1.5 * p.wall_n_per_m * encoder_m + 0.02);
      }
    }
  }

  TEST_CASE("beyond it: the oscillation is taken out, at encoders of some counts") {
    struct Row {
      Press press;
      double without_n, with_n;  // at least; at most
    };
    const Row rows[] = {{{1000, 1, 0, kLoose}, 1.5, 0.25},     {{2000, 1, 0, kLoose}, 4.0, 0.3},
                        {{5000, 1, 0, kLight}, 9.0, 0.01},     {{5000, 1, 0, kLoose}, 20.0, 0.4},
                        {{5000, 1, 1.0e-5, kLight}, 9.0, 2.0}, {{5000, 0, 0, kLoose}, 3.0, 0.4}};
    for (const Row& row : rows) {
      for (const bool angular : {false, true}) {
        Press p = row.press;
        p.angular = angular;
        const double with_n = press(p).rest_pp_n;
        p.layer = false;
        const double without_n = press(p).rest_pp_n;
        CAPTURE(p.wall_n_per_m);
        CAPTURE(p.delay);
        CAPTURE(p.encoder_m);
        CAPTURE(angular);
        MESSAGE(without_n << " N peak to peak without, " << with_n << " N with");
        CHECK(without_n > row.without_n);
        CHECK(with_n < row.with_n);
      }
    }
  }
}
