// SPDX-License-Identifier: Apache-2.0
// The hand that holds a plugged-in device.
#include <doctest/doctest.h>

#include "host_sim/device/hand_routine.hpp"

namespace haptic::sim {
namespace {

MotionSample sample(double t_s, double x_m) {
  MotionSample result;
  result.t_s = t_s;
  result.p[0] = x_m;
  return result;
}

}  // namespace

TEST_SUITE("host_sim.hand_routine") {
  TEST_CASE("hand: goes round where the motion closes, else stays at its end; regrips") {
    WorkspaceMap map;
    map.grip_a = Vec3(0, 0, 0.25_r);
    const std::vector<MotionSample> closed = {sample(0, 0), sample(0.01, 1), sample(0.02, 2),
                                              sample(0.03, 0)};
    const auto round = hand_routine(closed, 100, map, 1);
    const std::pair<double, double> ways[] = {{0.0, 0.0},  {0.02, 2.0}, {0.03, 0.0},
                                              {0.04, 1.0}, {0.05, 2.0}, {0.06, 0.0}};
    for (const auto& way : ways) {
      CAPTURE(way.first);
      CHECK(round(way.first).target.x0_w.x() == doctest::Approx(way.second));
      CHECK(round(way.first).target.x0_w.z() == doctest::Approx(0.25));
    }
    const auto stays = hand_routine({sample(0, 0), sample(0.01, 1)}, 100, map, 1);
    CHECK(stays(0.5).target.x0_w.x() == doctest::Approx(1));
    const auto rests = hand_routine({sample(0, 3)}, 100, map, 1);
    CHECK(rests(0.5).target.x0_w.x() == doctest::Approx(3));
    for (const double t_s : {0.0, 0.05, 1.05, 7.09}) CHECK(rests(t_s).switches == 0);
    for (const double t_s : {0.11, 0.99, 1.11}) CHECK(rests(t_s).switches == kDeadmanBit);
  }
}

}  // namespace haptic::sim
