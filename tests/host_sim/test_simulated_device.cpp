// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "host_sim/device/loop_run.hpp"
#include "host_sim/device/simulated_device.hpp"
#include "tests/support/program_run.hpp"
#include "tools/common/error.hpp"

using namespace haptic;
using namespace haptic::sim;

namespace {

/// The same axis by very small steps of a fourth-order Runge-Kutta method; without friction.
AxisState fine_steps(const AxisParameters& p, AxisState s, const AxisDrive& d, double period_s) {
  constexpr int kSteps = 2000;
  const double h = period_s / kSteps;
  const auto slope = [&](double t, const AxisState& a) {
    const double hand = p.hand_stiffness * (d.target + d.target_velocity * t - a.position) +
                        p.hand_damping * (d.target_velocity - a.velocity);
    return AxisState{a.velocity, (d.force - p.damping * a.velocity + hand) / p.inertia};
  };
  const auto plus = [](const AxisState& a, const AxisState& b, double f) {
    return AxisState{a.position + f * b.position, a.velocity + f * b.velocity};
  };
  for (int k = 0; k < kSteps; ++k) {
    const double t = k * h;
    const AxisState a = slope(t, s), b = slope(t + h / 2, plus(s, a, h / 2));
    const AxisState c = slope(t + h / 2, plus(s, b, h / 2)), e = slope(t + h, plus(s, c, h));
    s = plus(plus(plus(plus(s, a, h / 6), b, h / 3), c, h / 3), e, h / 6);
  }
  return s;
}

const Solid& wall() {
  static const Solid solid = centred_box("wall", 0.1, 0.1, 0.05);
  return solid;
}

std::vector<std::byte> wall_scene(double stiffness) {
  return scene_of(centred_box("cube", 0.01, 0.01, 0.01), {&wall(), 1}, stiffness, 1e-4);
}

/// Cube on the wall with its lower face at `depth` below the surface.
DeviceState pressed(double depth_m) {
  DeviceState state;
  state.x0_w = Vector(0, 0, 0.06 - depth_m);
  return state;
}

}  // namespace

TEST_SUITE("host_sim.simulated_device") {
  TEST_CASE("axis: one period is exact, with and without a hand") {
    const AxisParameters cases[] = {{0.1, 1, 0, 0, 0},        {0.1, 1, 0, 100, 0.2},
                                    {0.1, 1, 0, 800, 10},     {0.1, 0, 0, 0, 0},
                                    {1e-4, 1e-3, 0, 2, 1e-4}, {0.001, 1, 0, 50000, 20}};
    for (const AxisParameters& p : cases) {
      const AxisState start{0.002, -0.03};
      const AxisDrive drive{0.7, 0.004, 0.2};
      const AxisState exact = AxisMotion(p, 1e-3).advance(start, drive);
      const AxisState fine = fine_steps(p, start, drive, 1e-3);
      CAPTURE(p.inertia);
      CAPTURE(p.hand_stiffness);
      CHECK(std::abs(exact.position - fine.position) < 1e-10 * (1 + std::abs(fine.position)));
      CHECK(std::abs(exact.velocity - fine.velocity) < 1e-9 * (1 + std::abs(fine.velocity)));
    }
  }

  TEST_CASE("axis: Coulomb friction holds, slips and stops at the closed forms") {
    AxisParameters p{0.1, 0, 0.5, 0, 0};
    const AxisMotion axis(p, 1e-3);
    // Held below F_c.
    AxisState held = axis.advance({0.01, 0}, {0.4999, 0, 0});
    CHECK(held.position == 0.01);
    CHECK(held.velocity == 0);
    // Pushed with 2 N: (2 - 0.5) / 0.1 = 15 m/s^2.
    const AxisState pushed = axis.advance({0, 0}, {2, 0, 0});
    CHECK(pushed.velocity == doctest::Approx(15e-3).epsilon(1e-9));
    CHECK(pushed.position == doctest::Approx(7.5e-6).epsilon(1e-9));
    // Stops after v m / F_c = 0.5 ms, and stays: v^2 m / (2 F_c).
    const AxisState stopped = axis.advance({0, 0.0025}, {0, 0, 0});
    CHECK(stopped.velocity == 0);
    CHECK(stopped.position == doctest::Approx(0.0025 * 0.0025 * 0.1 / 1.0).epsilon(1e-9));
    // Turns round: against 2 N it stops after v m / 2.5 and comes back at 15 m/s^2.
    const AxisState turned = axis.advance({0, 0.01}, {-2, 0, 0});
    const double stop_s = 0.01 * 0.1 / 2.5;
    CHECK(turned.velocity == doctest::Approx(-15 * (1e-3 - stop_s)).epsilon(1e-7));
  }

  TEST_CASE("axis: a moving hand pulls a held axis loose when its spring exceeds F_c") {
    const AxisParameters p{0.1, 1, 0.3, 100, 0};
    const AxisMotion axis(p, 1e-3);
    AxisState state;
    double loose_at = -1;
    for (int k = 0; k < 100 && loose_at < 0; ++k) {
      state = axis.advance(state, {0, 0.05 * k * 1e-3, 0.05});
      if (state.position > 0) loose_at = k * 1e-3;
    }
    CHECK(loose_at == doctest::Approx(0.3 / (100 * 0.05)).epsilon(0.02));  // k_h v t = F_c
  }

  TEST_CASE("axis: Coulomb friction never gives energy, regardless of the forces") {
    Seeded random(7);
    for (int run = 0; run < 50; ++run) {
      const AxisParameters p{random.uniform(0.01, 1), 0, random.uniform(0.01, 1),
                             random.uniform(0, 3000), 0};
      const AxisMotion axis(p, 1e-3);
      AxisState s{0.01, random.uniform(-1, 1)};
      double energy = 0.5 * p.inertia * s.velocity * s.velocity +
                      0.5 * p.hand_stiffness * s.position * s.position;
      for (int k = 0; k < 200; ++k) {
        const double force = random.uniform(-2, 2), before = s.position;
        s = axis.advance(s, {force, 0, 0});
        const double now = 0.5 * p.inertia * s.velocity * s.velocity +
                           0.5 * p.hand_stiffness * s.position * s.position;
        CAPTURE(run);
        CHECK(now - energy <= force * (s.position - before) + 1e-12);
        energy = now;
      }
    }
  }

  TEST_CASE("device: delay, amplifier, encoder") {
    DeviceModel model;
    model.delay_samples = 2;
    model.max_force_n = 3;
    model.encoder_step_m = 1e-5;
    model.encoder_step_rad = 1e-3;
    SimulatedDevice device(model, *hand_named("none"), 1e-3);
    device.place({Vector(0.5, 0, 0), Rotation::Identity(), Vector::Zero(), Vector::Zero()});
    const Load command{Vector(0, 3, 4), Vector(0, 0, 0.01)};
    CHECK(device.advance(command, {device.sensed(), device.sensed()}).force_w.norm() == 0);
    CHECK(device.advance({}, {}).force_w.norm() == 0);
    const Load acting = device.advance({}, {});
    CHECK((acting.force_w - Vector(0, 1.8, 2.4)).norm() < 1e-12);
    CHECK(device.state().velocity_w.z() > 0);
    for (int k = 0; k < 50; ++k) static_cast<void>(device.advance({}, {}));
    const HandTarget seen = device.sensed();
    const double counts = seen.x0_w.z() / 1e-5;
    CHECK(std::abs(counts - std::nearbyint(counts)) < 1e-6);
    CHECK(std::abs(seen.x0_w.z() - device.state().x0_w.z()) <= 0.5e-5 + 1e-12);
    const double turn = rotation_vector(seen.q_wa).z() / 1e-3;
    CHECK(turn > 0.5);
    CHECK(std::abs(turn - std::nearbyint(turn)) < 1e-6);
  }

  TEST_CASE("device: work done on it is its kinetic energy when nothing damps") {
    DeviceModel model;
    model.damping_ns_per_m = 0;
    model.rotor_damping_nms_per_rad = 0;
    SimulatedDevice device(model, *hand_named("none"), 1e-3);
    for (int k = 0; k < 300; ++k) {
      const Load load{Vector(std::sin(0.1 * k), 1, 0), Vector(0, 2e-3, 1e-3 * std::cos(0.05 * k))};
      static_cast<void>(device.advance(load, {}));
    }
    const DeviceState& s = device.state();
    const double kinetic =
        0.05 * s.velocity_w.squaredNorm() + 0.5e-4 * s.angular_velocity_w.squaredNorm();
    CHECK(device.delivered_j() == doctest::Approx(kinetic).epsilon(1e-9));
    CHECK(kinetic > 0.1);
  }

  TEST_CASE("device: the hand brings it to its target, in translation and rotation") {
    for (const char* name : {"loose", "light", "firm"}) {
      SimulatedDevice device({}, *hand_named(name), 1e-3);
      const HandTarget target{Vector(0.01, -0.02, 0.03), rotation_of(Vector(0.4, -0.3, 1.2))};
      for (int k = 0; k < 10000; ++k) static_cast<void>(device.advance({}, {target, target}));
      CHECK((device.state().x0_w - target.x0_w).norm() < 1e-8);
      CHECK(device.state().q_wa.angularDistance(target.q_wa) < 1e-7);
    }
    CHECK_FALSE(hand_named("strong"));
  }

  TEST_CASE("loop: the cube rests on the wall where springs balance") {
    CoreSession session(wall_scene(1000), "wall");
    HandModel hand = *hand_named("light");
    ClosedLoop loop(session, {}, hand, 1000);
    loop.place(pressed(0.0005));
    const HandTarget target{Vector(0, 0, 0.06 - 0.004), Rotation::Identity()};
    LoopTick tick;
    for (int k = 0; k < 3000; ++k) tick = loop.step({target, target});
    // 1000 d = 300 (4 mm - d)
    const double depth = 0.06 - tick.device.x0_w.z();
    CHECK(depth == doctest::Approx(300 * 0.004 / 1300).epsilon(1e-3));
    CHECK(tick.device.velocity_w.norm() < 1e-6);
    CHECK(tick.t_s == doctest::Approx(2.999));
    CHECK((tick.acting.force_w - tick.result.wrench_w.force_w.cast<double>()).norm() == 0);
  }

  TEST_CASE(
      "loop: equal runs have equal bits; work given out is bounded where the loop is stable") {
    CoreSession session(wall_scene(500), "wall");
    ClosedLoop loop(session, {}, *hand_named("loose"), 1000);
    std::uint64_t hash[2] = {0, 1};
    for (std::uint64_t& h : hash) {
      loop.place(pressed(0.001));
      const HandTarget target{Vector(0.001, 0, 0.06 - 0.002), Rotation::Identity()};
      LoopTick tick;
      for (int k = 0; k < 500; ++k) tick = loop.step({target, target});
      h = tick.result.state_hash;
      CHECK(tick.delivered_j <= 0.5 * 500 * 1e-6 + 1e-9);  // the spring as it was loaded at first
    }
    CHECK(hash[0] == hash[1]);
  }

  TEST_CASE("loop: guided, the device stays where it is held and the core sees it there") {
    CoreSession session(wall_scene(1000), "wall");
    ClosedLoop loop(session, {}, *hand_named("none"), 1000);
    loop.place(pressed(-0.001));
    for (int k = 0; k < 20; ++k) loop.guide(pressed(0.001));
    const HandTarget target{Vector(0, 0, 0.06), Rotation::Identity()};
    const LoopTick tick = loop.step({target, target});
    CHECK(tick.tick == 20);
    CHECK(tick.device.velocity_w.norm() == 0);
    CHECK(static_cast<double>(tick.result.d_near_m) == doctest::Approx(-0.001).epsilon(1e-4));
    CHECK(tick.acting.force_w.z() == doctest::Approx(1.0).epsilon(1e-4));
    CHECK(loop.device().state().velocity_w.z() > 0);
  }

  TEST_CASE("device file: keys, units, refusals") {
    const test::ScratchFolder folder("device_file");
    const auto written = [&](const std::string& text) {
      const std::string path = folder.file("d.toml");
      std::ofstream(path) << text;
      return path;
    };
    const DeviceModel model = read_device_file(
        written("[device]\nmass_kg = 0.2\ncoulomb_friction_n = 0.05\ndelay_s = 0.001\n"
                "max_force_n = 8\nmax_stiffness_n_per_m = 3000\nencoder_step_rad = 1e-4\n"),
        2000);
    CHECK(model.mass_kg == 0.2);
    CHECK(model.coulomb_force_n == 0.05);
    CHECK(model.delay_samples == 2);
    CHECK(model.max_force_n == 8);
    CHECK(model.encoder_step_rad == 1e-4);
    CHECK(model.damping_ns_per_m == 1.0);
    for (const char* bad :
         {"", "[device]\nmas_kg = 1\n", "[device]\nmass_kg = -1\n", "[device]\nmass_kg = \"1\"\n",
          "device = 1\n", "[device]\nmass_kg =\n", "[device]\ndelay_s = 1\n", "[device]\n[other]\n",
          "[device]\ndelay_samples = 1.5\n"}) {
      CAPTURE(bad);
      CHECK_THROWS_AS(static_cast<void>(read_device_file(written(bad), 1000)), tools::InputError);
    }
    DeviceModel weightless;
    weightless.mass_kg = 0;
    CHECK_THROWS_AS(SimulatedDevice(weightless, *hand_named("none"), 1e-3), tools::InputError);
  }
}
