// SPDX-License-Identifier: Apache-2.0
// A scene without a [device] on a device that is simulated: gains that the loop holds.
#include <doctest/doctest.h>

#include <algorithm>
#include <string>

#include "tools/graph_compiler/coupling/passivity_budget.hpp"
#include "tools/graph_compiler/coupling/simulated_gains.hpp"
#include "tools/graph_compiler/graph/coupling_defaults.hpp"
#include "tools/graph_compiler/graph/scene_writer.hpp"

using namespace haptic;
using namespace haptic::tools;

namespace {

constexpr double kGainsRadius_m = 0.03;

/// 800 N/m, and in rotation what the default length makes of it: 14.6 N m/rad.
SceneParameters scene_of_law(LawId law) {
  SceneParameters p = default_parameters();
  p.law = law;
  p.rate_hz = 1000;
  p.device = {};
  p.k_f_n_per_m = 800;
  p.coupling = {};
  complete_coupling(p, kGainsRadius_m);
  return p;
}

SimulatedLoop loop_of(double delay_s = 0) {
  SimulatedLoop loop;
  loop.device.mass_kg = 0.1;
  loop.device.damping_ns_per_m = 1;
  loop.device.delay_s = delay_s;
  std::ranges::fill(loop.device.rotor_inertia_kg_m2, 1e-4);
  std::ranges::fill(loop.device.rotor_damping_nms_per_rad, 1e-3);
  return loop;
}

SampledAxis gains_axis(double inertia, double damping, double delay_s) {
  SampledAxis axis;
  axis.mass_kg = inertia;
  axis.damping_ns_per_m = damping;
  axis.period_s = 1e-3;
  axis.delay_s = delay_s;
  return axis;
}

bool gains_text_has(const std::string& text, const std::string& words) {
  return text.find(words) != std::string::npos;
}

}  // namespace

TEST_SUITE("tools.simulated_gains") {
  TEST_CASE("gains that the loop does not hold are lowered to half of what its damping holds") {
    for (const double delay_s : {0.0, 1e-3, 2e-3}) {
      CAPTURE(delay_s);
      const SceneParameters scene = scene_of_law(LawId::kProxy);
      const auto gains = simulated_gains(scene, kGainsRadius_m, loop_of(delay_s));
      REQUIRE(gains);
      const SampledAxis translation = gains_axis(0.1, 1, delay_s);
      const SampledAxis rotation = gains_axis(1e-4, 1e-3, delay_s);
      // The scene's own are no loop that holds; those rendered hold with twice as much.
      CHECK_FALSE(is_stable(rotation, scene.coupling.k_r_nm_per_rad, 0));
      CHECK(is_stable(rotation, gains->k_r_nm_per_rad, 0));
      CHECK(is_stable(rotation, 1.99 * gains->k_r_nm_per_rad, 0));
      CHECK_FALSE(is_stable(rotation, 2.01 * gains->k_r_nm_per_rad, 0));
      CHECK(is_stable(translation, 1.99 * gains->k_t_n_per_m, 0));
      CHECK(gains->k_t_n_per_m ==
            doctest::Approx(std::min(800.0, 0.5 * stiffness_boundary(translation, 0))));
      CHECK(gains_text_has(gains->text,
                           "800 N/m and 14.58 N m/rad, is more than the simulated device holds"));
      CHECK(gains_text_has(gains->text, "[device]"));
      SceneParameters changed = scene;
      gains->put(changed);
      CHECK(changed.coupling.k_t_n_per_m == gains->k_t_n_per_m);
      CHECK(changed.coupling.k_r_nm_per_rad == gains->k_r_nm_per_rad);
      CHECK(changed.k_f_n_per_m == 800);
      // What is rendered now is held: nothing more to lower.
      CHECK_FALSE(simulated_gains(changed, kGainsRadius_m, loop_of(delay_s)));
    }
  }

  TEST_CASE(
      "a scene with a device, one that allows active gains, and soft gains stay as they are") {
    SceneParameters scene = scene_of_law(LawId::kProxy);
    scene.coupling.allow_active = 1;
    CHECK_FALSE(simulated_gains(scene, kGainsRadius_m, loop_of()));
    scene.coupling.allow_active = 0;
    scene.device.given = 1;
    CHECK(simulated_gains(scene, kGainsRadius_m,
                          loop_of()));  // it names no mass: no budget was computed
    scene.device.mass_kg = 0.2;
    CHECK_FALSE(simulated_gains(scene, kGainsRadius_m, loop_of()));
    scene = scene_of_law(LawId::kProxy);
    scene.coupling.k_r_nm_per_rad = 0.9;
    CHECK_FALSE(simulated_gains(scene, kGainsRadius_m, loop_of()));
  }

  TEST_CASE("a grip that holds every torque leaves the stiffness of rotation") {
    SceneParameters scene = scene_of_law(LawId::kProxy);
    SimulatedLoop loop = loop_of();
    loop.turns = false;
    CHECK_FALSE(simulated_gains(scene, kGainsRadius_m, loop));
    scene.coupling.k_t_n_per_m = 5000;
    const auto gains = simulated_gains(scene, kGainsRadius_m, loop);
    REQUIRE(gains);
    CHECK(gains->k_t_n_per_m < 1002);
    CHECK(gains->k_r_nm_per_rad == scene.coupling.k_r_nm_per_rad);
    CHECK_FALSE(gains_text_has(gains->text, "N m/rad"));
  }

  TEST_CASE("a coupling damping beyond what is safe alone is lowered too") {
    SceneParameters scene = scene_of_law(LawId::kProxy);
    scene.coupling.damping_ns_per_m = 500;
    const auto gains = simulated_gains(scene, kGainsRadius_m, loop_of());
    REQUIRE(gains);
    CHECK(gains->damping_ns_per_m < 500);
    CHECK(is_stable(gains_axis(0.1, 1, 0), gains->k_t_n_per_m, gains->damping_ns_per_m));
  }

  TEST_CASE("the direct laws: the stiffness of one plane, within the budget of a slot") {
    const SceneParameters scene = scene_of_law(LawId::kPaper);
    const auto gains = simulated_gains(scene, kGainsRadius_m, loop_of(1e-3));
    REQUIRE(gains);
    CHECK(gains->k_f_n_per_m < 400);
    CHECK(is_stable(gains_axis(0.1, 1, 1e-3), 2 * gains->k_f_n_per_m, 0));
    CHECK(gains_text_has(gains->text, "800 N/m, is more"));
  }

  TEST_CASE("a device that holds nothing is no better with less: the scene is rendered as it is") {
    SimulatedLoop loop = loop_of();
    loop.device.damping_ns_per_m = 0;
    std::ranges::fill(loop.device.rotor_damping_nms_per_rad, 0.0);
    CHECK_FALSE(simulated_gains(scene_of_law(LawId::kProxy), kGainsRadius_m, loop));
  }
}
