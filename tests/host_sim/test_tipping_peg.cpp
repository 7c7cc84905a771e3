// SPDX-License-Identifier: Apache-2.0
// A round peg that stands in a square hole and is pulled over its rim: the points that it stands
// on, those on the wall and those of the step that tips it are more rows than one program has.
#include <doctest/doctest.h>

#include <string>
#include <vector>

#include "host_sim/lab/strangers/tried_scene.hpp"

using namespace haptic;
using namespace haptic::sim;

namespace {

constexpr const char* kScene = R"(format = 1
name = "tipping_peg"
[moving]
shape = "cylinder"
radius_m = 0.012967325
height_m = 0.0353050025
position_m = [0, 0, 0.0360448209]
material = "steel"
[[static]]
shape = "box"
size_m = [0.0166871303, 0.0275205221, 0.00566206769]
position_m = [-0.0221038262, 0, -0.00283103384]
material = "steel"
[[static]]
shape = "box"
size_m = [0.0166871303, 0.0275205221, 0.00566206769]
position_m = [0.0221038262, 0, -0.00283103384]
material = "steel"
[[static]]
shape = "box"
size_m = [0.0608947827, 0.0166871303, 0.00566206769]
position_m = [0, -0.0221038262, -0.00283103384]
material = "steel"
[[static]]
shape = "box"
size_m = [0.0608947827, 0.0166871303, 0.00566206769]
position_m = [0, 0.0221038262, -0.00283103384]
material = "steel"
[[static]]
shape = "box"
size_m = [0.1, 0.1, 0.0166871303]
position_m = [0, 0, -0.0140056328]
material = "steel"
[rendering]
k_f_n_per_m = 800
[device]
mass_kg = 0.1
damping_ns_per_m = 1
[budget]
work_units = 20000
[[friction]]
materials = ["steel", "steel"]
mu = 0.336
)";

double soft(double share) { return share * share * (3 - 2 * share); }

/// Down on the floor, aside against a wall, and along that.
std::vector<MotionSample> pull_over_the_rim() {
  constexpr double kAbove_m = 0.0360448, kPressed_m = 0.00881, kAside_m = 0.005, kAlong_m = 0.0005;
  std::vector<MotionSample> motion;
  const auto add = [&](double x, double y, double z) {
    MotionSample sample;
    sample.t_s = 1e-3 * static_cast<double>(motion.size());
    sample.p[0] = x;
    sample.p[1] = y;
    sample.p[2] = z;
    motion.push_back(sample);
  };
  for (int k = 0; k < 400; ++k) add(0, 0, kAbove_m + (kPressed_m - kAbove_m) * soft(k / 400.0));
  for (int k = 0; k < 700; ++k) add(0, -kAside_m * soft(k / 700.0), kPressed_m);
  for (int k = 0; k < 300; ++k) {
    const double along_m = kAlong_m * (k / 300.0) * (k / 300.0);
    add(along_m, along_m - kAside_m, kPressed_m);
  }
  return motion;
}

}  // namespace

TEST_SUITE("host_sim.tipping_peg") {
  TEST_CASE("a peg pulled over the rim of its hole tips, and is never stuck") {
    TriedScene tried(kScene, {});
    const std::vector<PlayedTick> ticks = tried.play(pull_over_the_rim());
    int stuck = 0;
    for (const PlayedTick& tick : ticks) stuck += (tick.flags & kFlagProxyStuck) != 0 ? 1 : 0;
    CHECK(stuck == 0);
    CHECK(ticks.back().torque_nm.norm() > 1e-3);
  }
}
