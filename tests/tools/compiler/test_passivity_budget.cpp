// SPDX-License-Identifier: Apache-2.0
// The boundary of stability against its closed forms and against a loop that is run tick by tick;
// the budget against the same loop: stable at it, unstable at 1.5 times it.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/support/shapes.hpp"
#include "tools/graph_compiler/coupling/passivity_budget.hpp"
#include "tools/graph_compiler/coupling/served_size.hpp"

using namespace haptic;
using namespace haptic::test;
using tools::PassivityBudget;
using tools::SampledAxis;

namespace {

SampledAxis axis_of(double mass, double damping, double period, double delay_ticks = 0.0) {
  return {mass, damping, period, delay_ticks * period, 1};
}

/// State of the device, moved exactly under a constant force.
struct Device {
  double x = 1e-3, v = 0.0;

  void move(const SampledAxis& axis, double force, double t) {
    const double m = axis.mass_kg, b = axis.damping_ns_per_m;
    if (b == 0.0) {
      x += t * (v + 0.5 * t * force / m);
      v += t * force / m;
      return;
    }
    const double rest = force / b;  // the speed at which damping balances the force
    x += rest * t + (v - rest) * m / b * (1.0 - std::exp(-b * t / m));
    v = rest + (v - rest) * std::exp(-b * t / m);
  }
};

/// Largest |x| in the last quarter of a run over that in its second quarter.
double growth(const SampledAxis& axis, double stiffness, double damping, int ticks) {
  Device device;
  const double t = axis.period_s, delay = axis.delay_s / t;
  const auto whole = static_cast<std::size_t>(delay + 1e-9);
  const double late = std::max(0.0, delay - static_cast<double>(whole));
  const std::size_t w = axis.window_ticks;
  std::vector<double> positions(w + 1, device.x), forces(whole + 2, 0.0);
  double early = 0.0, last = 0.0;
  for (int n = 0; n < ticks; ++n) {
    positions.insert(positions.begin(), device.x);
    positions.pop_back();
    const double speed = (positions[0] - positions[w]) / (static_cast<double>(w) * t);
    forces.insert(forces.begin(), -stiffness * positions[0] - damping * speed);
    forces.pop_back();
    device.move(axis, forces[whole + 1], late * t);
    device.move(axis, forces[whole], (1.0 - late) * t);
    const double size = std::abs(device.x);
    if (size > 1e9) return 1e9;
    if (n >= ticks / 4 && n < ticks / 2) early = std::max(early, size);
    if (n >= 3 * (ticks / 4)) last = std::max(last, size);
  }
  return early > 1e-280 ? last / early : 0.0;
}

SceneParameters device_scene(LawId law, double k, double b, double delay_s, double rate_hz) {
  SceneParameters p = tools::default_parameters();
  p.law = law;
  p.k_f_n_per_m = k;
  p.rate_hz = rate_hz;
  p.device.given = 1;
  p.device.mass_kg = 0.1;
  p.device.damping_ns_per_m = b;
  p.device.delay_s = delay_s;
  p.coupling.min_window_s = 1.0 / rate_hz;
  p.coupling.max_window_s = 0.02;
  return p;
}

}  // namespace

TEST_SUITE("tools.passivity_budget") {
  TEST_CASE("direct rendering: the boundary is the closed form, above it where b T / m is large") {
    constexpr double kExpected[3][3] = {{2000, 667, 400}, {4000, 1333, 800}, {8000, 2667, 1600}};
    for (int rate = 0; rate < 3; ++rate) {
      const double period = 1e-3 / (1 << rate);
      for (int d = 0; d < 3; ++d) {
        const SampledAxis axis = axis_of(0.1, 1.0, period, d);
        const double form = tools::first_order_stiffness(axis);
        CHECK(form == doctest::Approx(kExpected[rate][d]).epsilon(1e-3));
        const double exact = tools::stiffness_boundary(axis, 0.0);
        CHECK(exact >= form * (1.0 - 1e-6));
        CHECK(exact <= 1.005 * form);
        // b T / m = 1.
        const SampledAxis light = axis_of(1.0 * period, 1.0, period, d);
        const double ratio =
            tools::stiffness_boundary(light, 0.0) / tools::first_order_stiffness(light);
        CHECK(ratio > 1.0);
        CHECK(ratio < 1.28);
      }
    }
  }

  TEST_CASE("virtual damping: its limit alone and the best stiffness with it") {
    constexpr double kBest[3][2] = {{0.83, 0.69}, {0.42, 0.145}, {0.29, 0.063}};
    constexpr double kAlone[3] = {2.0, 0.828, 0.536};
    const double m = 0.1, t = 1e-3;
    for (int d = 0; d < 3; ++d) {
      const SampledAxis free = axis_of(m, 0.0, t, d);
      const double form = tools::first_order_damping(free);
      CHECK(form == doctest::Approx(kAlone[d] * m / t).epsilon(1e-3));
      CHECK(tools::damping_boundary(free, 0.0) == doctest::Approx(form).epsilon(1e-3));
      const SampledAxis damped = axis_of(m, 0.1, t, d);
      const double k = tools::stiffness_boundary(damped, kBest[d][0] * m / t);
      CHECK(k * t * t / m == doctest::Approx(kBest[d][1]).epsilon(0.03));
    }
  }

  TEST_CASE("no damping of any kind: no stiffness is stable") {
    for (int d = 0; d < 3; ++d) {
      const SampledAxis axis = axis_of(0.1, 0.0, 1e-3, d);
      CHECK(tools::stiffness_boundary(axis, 0.0) == 0.0);
      CHECK(!tools::is_stable(axis, 1.0, 0.0));
    }
    CHECK(!tools::is_stable(axis_of(0.1, 1.0, 1e-3, 65), 1.0, 0.0));
  }

  TEST_CASE("random axes: the loop itself dies out at the budget and grows at 1.5 times it") {
    constexpr std::uint64_t kSeed = 20260511;
    CAPTURE(kSeed);
    Random random(kSeed);
    for (int round = 0; round < 60; ++round) {
      CAPTURE(round);
      const double m = std::pow(10.0, random.uniform(-3, 1));
      const double t = 1e-3 / static_cast<double>(1u << (random.next() % 3));
      const double b = std::pow(10.0, random.uniform(-2.0, -0.2)) * m / t;
      // Whole samples of delay, and fractions of one.
      double delay = static_cast<double>(random.next() % 3);
      if (round % 3 == 0) delay += random.uniform(0.0, 0.9);
      SampledAxis axis = axis_of(m, b, t, delay);
      axis.window_ticks = 1 + static_cast<std::uint32_t>(random.next() % 3);
      const double damping =
          round % 2 == 0 ? 0.0 : random.uniform(0.0, 0.4) * tools::damping_boundary(axis, 0.0);
      const double budget = tools::stiffness_boundary(axis, damping) / tools::kBudgetMargin;
      REQUIRE(budget > 0.0);
      CHECK(growth(axis, budget, damping, 20000) < 0.9);
      CHECK(growth(axis, 1.5 * budget, damping, 20000) > 1.1);
      const double most = tools::damping_boundary(axis, 0.3 * budget);
      CHECK(growth(axis, 0.3 * budget, most / tools::kBudgetMargin, 20000) < 0.9);
      CHECK(growth(axis, 0.3 * budget, 1.1 * most, 20000) > 1.1);
    }
  }

  TEST_CASE("law proxy: every state has the spring's own stiffness, the others add planes") {
    SceneParameters p = device_scene(LawId::kProxy, 1000.0, 1.0, 0.0, 1000.0);
    std::ranges::fill(p.device.rotor_inertia_kg_m2, 0.1 * 0.03 * 0.03);
    std::ranges::fill(p.device.rotor_damping_nms_per_rad, 0.03 * 0.03);
    p.coupling.k_r_nm_per_rad = 1000.0 * 0.03 * 0.03;
    tools::complete_coupling(p, 0.04);
    const PassivityBudget proxy = tools::passivity_budget(p, 0.04);
    REQUIRE(proxy.unchecked.empty());
    REQUIRE(proxy.states.size() == 5);
    for (const tools::ContactStateBudget& s : proxy.states) {
      CAPTURE(s.state);
      const double unit = std::string(s.gain) == "k_r_nm_per_rad" ? 0.03 * 0.03 : 1.0;
      CHECK(s.stiffness == doctest::Approx(unit * 2000.0 / 1.25).epsilon(3e-3));
      CHECK(s.holds());
    }
    CHECK(proxy.holds());
    CHECK(proxy.passive_n_per_m == doctest::Approx(2000.0));
    CHECK(proxy.limit_of("k_t_n_per_m") == proxy.states[0].stiffness);
    p.law = LawId::kPaper;
    const PassivityBudget paper = tools::passivity_budget(p, 0.04);
    CHECK(paper.states[1].stiffness == doctest::Approx(paper.states[0].stiffness / 2));
    CHECK(paper.limit_of("k_f_n_per_m") == doctest::Approx(2000.0 / 2.5).epsilon(3e-3));
    CHECK(!paper.holds());
  }

  TEST_CASE("rotation: the rotor's least stable axis decides, the radius of the part does not") {
    SceneParameters p = device_scene(LawId::kProxy, 1000.0, 1.0, 0.001, 1000.0);
    const double inertia[] = {3e-4, 1e-4, 2e-4}, damping[] = {4e-3, 3e-3, 1e-3};
    std::ranges::copy(inertia, p.device.rotor_inertia_kg_m2);
    std::ranges::copy(damping, p.device.rotor_damping_nms_per_rad);
    const auto rotary = [&](double radius_m) {
      SceneParameters sized = p;
      tools::complete_coupling(sized, radius_m);
      return tools::passivity_budget(sized, radius_m);
    };
    const PassivityBudget budget = rotary(0.04);
    CHECK(!budget.rotor_assumed);
    CHECK(budget.rotation.mass_kg == 2e-4);
    CHECK(budget.rotation.damping_ns_per_m == 1e-3);
    const double limit = budget.limit_of("k_r_nm_per_rad");
    CHECK(limit == doctest::Approx(1e-3 / 1.5e-3 / tools::kBudgetMargin).epsilon(3e-3));
    CHECK(rotary(0.25).limit_of("k_r_nm_per_rad") == limit);
    // The coupling's damping is a hundred times the rotor's.
    p.device.delay_s = 0.0;
    std::ranges::fill(p.device.rotor_inertia_kg_m2, 1e-4);
    std::ranges::fill(p.device.rotor_damping_nms_per_rad, 1e-3);
    p.coupling.damping_ns_per_m = 1.0;
    p.coupling.k_t_n_per_m = 800.0;
    const PassivityBudget damped = rotary(0.5);
    const double most = damped.limit_of("k_r_nm_per_rad");
    CHECK(most == doctest::Approx(69.8 / tools::kBudgetMargin).epsilon(0.01));
    CHECK(!damped.holds());
    CHECK(growth(damped.rotation, most, most / 800.0, 20000) < 0.9);
    CHECK(growth(damped.rotation, 1.5 * most, 1.5 * most / 800.0, 20000) > 1.1);
    p.device.delay_s = 0.001;
    p.coupling.damping_ns_per_m = 0.0;
    std::ranges::copy(inertia, p.device.rotor_inertia_kg_m2);
    std::ranges::copy(damping, p.device.rotor_damping_nms_per_rad);
    CHECK(growth(budget.rotation, limit, 0.0, 20000) < 0.9);
    CHECK(growth(budget.rotation, 1.5 * limit, 0.0, 20000) > 1.1);
    std::ranges::fill(p.device.rotor_inertia_kg_m2, 0.0);
    std::ranges::fill(p.device.rotor_damping_nms_per_rad, 0.0);
    CHECK(rotary(0.04).rotor_assumed);
    CHECK(rotary(0.04).rotation.mass_kg == doctest::Approx(0.1 * 1e-4));
    CHECK(rotary(0.25).rotation.damping_ns_per_m == doctest::Approx(1e-4));
  }

  TEST_CASE("coupling damping raises the stiffness that is safe, as the loop itself finds") {
    SceneParameters p = device_scene(LawId::kProxy, 500.0, 1.0, 0.001, 1000.0);
    tools::complete_coupling(p, 0.04);
    const double without = tools::passivity_budget(p, 0.04).limit_of("k_t_n_per_m");
    p.coupling.damping_ns_per_m = 1.0;
    const PassivityBudget with = tools::passivity_budget(p, 0.04);
    CHECK(with.limit_of("k_t_n_per_m") > 1.5 * without);
    CHECK(with.passive_n_per_m == 0.0);
    p.coupling.damping_ns_per_m = 1000.0;
    const PassivityBudget wild = tools::passivity_budget(p, 0.04);
    CHECK(!wild.damping_holds());
    CHECK(wild.limit_of("k_t_n_per_m") == 0.0);
  }

  TEST_CASE("without a device or its mass no budget is checked; friction beats encoder steps") {
    SceneParameters p = device_scene(LawId::kProxy, 500.0, 1.0, 0.0, 1000.0);
    tools::complete_coupling(p, 0.04);
    p.device.coulomb_friction_n = 0.05;
    p.device.encoder_step_m = 2e-5;
    CHECK(tools::passivity_budget(p, 0.04).encoder_n_per_m == doctest::Approx(5000.0));
    p.device.mass_kg = 0.0;
    CHECK(tools::passivity_budget(p, 0.04).unchecked == "[device] gives no mass_kg");
    p.device.given = 0;
    CHECK(tools::passivity_budget(p, 0.04).unchecked == "no [device]");
  }
}

TEST_SUITE("tools.served_size") {
  TEST_CASE("lengths grow with the part; rounding sets the floor and the largest offset") {
    tools::SceneDescription d =
        scene_of(box({-0.03, -0.04, 0}, {0.03, 0.04, 0}), {box({0, 0, 0}, {0.1, 0.1, 0.1})});
    d.moving.body = box({-0.03, -0.04, -0.0}, {0.03, 0.04, 0.01});
    d.parameters.law = LawId::kProxy;
    const LoadedScene scene(d);
    const tools::ServedSize size = tools::served_size(scene.view);
    const double radius = std::sqrt(0.03 * 0.03 + 0.04 * 0.04 + 0.01 * 0.01);
    CHECK(size.radius_m == doctest::Approx(radius));
    CHECK(size.length_scale == doctest::Approx(radius / 0.05));
    CHECK(size.stiffness_share == doctest::Approx(1.0 / (1.0 + 1.0 / (4.5 * 4.5))));
    CHECK(tools::size_refusal(size).empty());
    CHECK(size.floored == (sizeof(Real) == sizeof(float)));
    if (!size.floored) CHECK(size.tolerance_m == doctest::Approx(1e-7 * radius / 0.05));
    CHECK(size.largest_offset_m / radius ==
          doctest::Approx(sizeof(Real) == sizeof(float) ? 131.07 : 7.037e10).epsilon(1e-3));
  }

  TEST_CASE("sizes and offsets that are not served are refused with range and fix") {
    tools::ServedSize size;
    size.radius_m = 2e-8;
    size.largest_offset_m = 1.0;
    CHECK(tools::size_refusal(size).find("serves 1e-07 to 1e+04 m") != std::string::npos);
    size.radius_m = 2e4;
    CHECK(tools::size_refusal(size).find("check scale_to_m") != std::string::npos);
    size.radius_m = 0.01;
    size.coordinate_m = 1.01;
    CHECK(tools::size_refusal(size).find("within 1 m; move the scene") != std::string::npos);
    size.coordinate_m = 0.99;
    CHECK(tools::size_refusal(size).empty());
  }
}
