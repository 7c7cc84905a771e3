// SPDX-License-Identifier: Apache-2.0
// Scene, map and loop against what a connected device states; what a machine that is late costs.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "hal/drivers/reference_driver.hpp"
#include "tools/graph_compiler/coupling/passivity_budget.hpp"
#include "tools/graph_compiler/graph/scene_writer.hpp"
#include "tools/run_device/device_fit.hpp"

using namespace haptic;
using namespace haptic::tools;

namespace {

constexpr double kRadius_m = 0.05;

hal::DeviceCapabilities stated_device() {
  hal::DeviceCapabilities c = hal::reference_capabilities();
  c.mass_kg = 0.2_r;
  c.damping_ns_per_m = 5;
  return c;
}

/// A scene without [device], clocked by reports, with gains that the device above can hold.
FitQuestion modest_question() {
  FitQuestion q;
  q.scene = default_parameters();
  q.scene.rate_hz = 1000;
  q.scene.device = {};
  std::ranges::fill(q.scene.device.rotor_inertia_kg_m2, 2.8e-4);
  std::ranges::fill(q.scene.device.rotor_damping_nms_per_rad, 7e-3);
  q.scene.coupling.k_t_n_per_m = 800;
  q.scene.coupling.k_r_nm_per_rad = 0.5;
  q.scene.coupling.damping_ns_per_m = 1;
  q.radius_m = kRadius_m;
  q.report_clocked = true;
  return q;
}

bool says(const FitAnswer& answer, const std::string& part) {
  for (const std::string& note : answer.notes) {
    if (note.find(part) != std::string::npos) return true;
  }
  return false;
}

/// The largest factor on k_t and k_r that the gate lets through.
double largest_factor(FitQuestion q, const hal::DeviceCapabilities& device) {
  const FitQuestion unscaled = q;
  double low = 0.01, high = 100;
  for (int k = 0; k < 40; ++k) {
    const double factor = std::sqrt(low * high);
    q.scene.coupling.k_t_n_per_m = factor * unscaled.scene.coupling.k_t_n_per_m;
    q.scene.coupling.k_r_nm_per_rad = factor * unscaled.scene.coupling.k_r_nm_per_rad;
    (fit_of(q, device).refusal.empty() ? low : high) = factor;
  }
  return low;
}

hal::WakeupMeasurement woken(std::int64_t largest_ns) {
  hal::WakeupMeasurement m;
  for (int k = 0; k < 1999; ++k) m.lateness.add(20'000);
  m.lateness.add(largest_ns);
  return m;
}

}  // namespace

TEST_SUITE("tools.run_device.fit") {
  TEST_CASE("a scene without [device]: its budget is computed against the connected one") {
    const FitAnswer answer = fit_of(modest_question(), stated_device());
    CHECK(answer.refusal == "");
    CHECK(says(answer, "within the passivity budget of this device: k_t_n_per_m 800 of "));

    FitQuestion bold = modest_question();
    bold.scene.coupling.k_t_n_per_m = 50'000;
    const FitAnswer refused = fit_of(bold, stated_device());
    CHECK(refused.refusal.find("k_t_n_per_m is 5e+04, at most ") != std::string::npos);
    CHECK(refused.refusal.find("--accept-unbudgeted") != std::string::npos);
    bold.accept_unbudgeted = true;
    CHECK(fit_of(bold, stated_device()).refusal == "");
    CHECK(says(fit_of(bold, stated_device()), "accepted by --accept-unbudgeted"));
    bold.accept_unbudgeted = false;
    bold.scene.coupling.allow_active = 1;
    CHECK(fit_of(bold, stated_device()).refusal == "");
    CHECK(says(fit_of(bold, stated_device()), "allow_active"));
  }

  TEST_CASE("a rotor that nobody states is taken for a light one") {
    FitQuestion q = modest_question();
    q.scene.coupling.k_r_nm_per_rad = 10;
    CHECK(fit_of(q, stated_device()).refusal == "");
    std::ranges::fill(q.scene.device.rotor_inertia_kg_m2, 0.0);
    std::ranges::fill(q.scene.device.rotor_damping_nms_per_rad, 0.0);
    CHECK(fit_of(q, stated_device()).refusal.find("k_r_nm_per_rad is 10, at most ") !=
          std::string::npos);
  }

  TEST_CASE("a device without torque is not refused for a stiffness in rotation") {
    FitQuestion q = modest_question();
    q.scene.coupling.k_r_nm_per_rad = 5000;
    CHECK(fit_of(q, stated_device()).refusal.find("k_r_nm_per_rad is 5000") != std::string::npos);
    hal::DeviceCapabilities c = stated_device();
    c.driven_dof = hal::kDofTranslation;
    CHECK(fit_of(q, c).refusal == "");
    q.scene.law = LawId::kPaper;
    q.scene.k_f_n_per_m = 300;
    q.radius_m = 10;
    CHECK(fit_of(q, c).refusal == "");
    q.scene.k_f_n_per_m = 50'000;
    CHECK(fit_of(q, c).refusal.find("k_f_n_per_m is 5e+04") != std::string::npos);
  }

  TEST_CASE("no mass stated anywhere: refused, or accepted, never taken for granted") {
    hal::DeviceCapabilities c = stated_device();
    c.mass_kg = 0;
    FitQuestion q = modest_question();
    CHECK(fit_of(q, c).refusal.find("states no mass") != std::string::npos);
    q.accept_unbudgeted = true;
    CHECK(fit_of(q, c).refusal == "");
    q.accept_unbudgeted = false;
    q.scene.device.given = 1;  // the scene's own number
    q.scene.device.mass_kg = 0.2;
    q.scene.device.damping_ns_per_m = 5;
    CHECK(fit_of(q, c).refusal == "");
  }

  TEST_CASE(
      "the latency that a device states counts: less is let through, or nothing, and it is said") {
    FitQuestion q = modest_question();
    hal::DeviceCapabilities c = stated_device();
    const double at_once = largest_factor(q, c);
    CHECK_FALSE(says(fit_of(q, c), "latency"));
    c.latency_ns = 500'000;
    const double late = largest_factor(q, c);
    CHECK(late < at_once);
    // The same as a scene that states the whole delay itself: half a period and the latency.
    FitQuestion whole = q;
    whole.scene.device.delay_s = 1.0e-3;
    CHECK(largest_factor(whole, stated_device()) == doctest::Approx(late));
    CHECK(largest_factor(whole, c) == doctest::Approx(late));
    CHECK(says(fit_of(q, c), "with 0.5 ms of latency that the device states"));
    c.latency_ns = 100'000'000;
    const FitAnswer refused = fit_of(q, c);
    CHECK(refused.refusal.find("with 100 ms of latency that the device states") !=
          std::string::npos);
    CHECK(refused.refusal.find("100.5 ms late") != std::string::npos);
    q.accept_unbudgeted = true;
    CHECK(fit_of(q, c).refusal == "");
    CHECK(says(fit_of(q, c), "with 100 ms of latency"));
  }

  TEST_CASE("what is let through is the budget's: sampled, late and scaled as it will be") {
    const hal::DeviceCapabilities c = stated_device();
    FitQuestion q = modest_question();
    SceneParameters p = q.scene;
    p.device.given = 1;
    p.device.mass_kg = 0.2;
    p.device.damping_ns_per_m = 5;
    p.device.delay_s = 0.5e-3;
    const auto factor_of = [&p] {
      const PassivityBudget b = passivity_budget(p, kRadius_m);
      return std::min(b.limit_of("k_t_n_per_m") / p.coupling.k_t_n_per_m,
                      b.limit_of("k_r_nm_per_rad") / p.coupling.k_r_nm_per_rad);
    };
    const double at_once = factor_of();
    CHECK(largest_factor(q, c) == doctest::Approx(at_once).epsilon(1e-3));
    // By a timer, a command waits for the next report.
    q.report_clocked = false;
    p.device.delay_s = 1.0e-3;
    const double waiting = factor_of();
    CHECK(waiting < at_once);
    CHECK(largest_factor(q, c) == doctest::Approx(waiting).epsilon(1e-3));
    // Reports every 4 ms are what a loop of 1 ms has.
    hal::DeviceCapabilities slow = c;
    slow.report_period_ns = 4'000'000;
    p.rate_hz = 250;
    p.device.delay_s = 4.0e-3;
    const double sampled_slowly = factor_of();
    CHECK(sampled_slowly < waiting);
    CHECK(largest_factor(q, slow) == doctest::Approx(sampled_slowly).epsilon(1e-3));
    CHECK(says(fit_of(q, slow), "reports every 4 ms and the loop ticks every 1 ms"));
    // At scale s the device feels s^2 of the stiffness.
    q.scale = 2;
    FitQuestion plain = modest_question();
    plain.report_clocked = false;
    plain.scene.coupling.damping_ns_per_m = q.scene.coupling.damping_ns_per_m = 0;
    plain.scene.coupling.k_r_nm_per_rad = q.scene.coupling.k_r_nm_per_rad = 1e-6;
    CHECK(largest_factor(q, c) == doctest::Approx(largest_factor(plain, c) / 4).epsilon(1e-3));
  }

  TEST_CASE("a scene or a loop for more reports than the device delivers: both rates are named") {
    hal::DeviceCapabilities c = stated_device();
    FitQuestion q = modest_question();
    q.report_clocked = false;
    q.accept_unbudgeted = true;
    q.scene.rate_hz = 10'000;
    q.loop_period_ns = 100'000;
    const FitAnswer slow = fit_of(q, c);
    CHECK(slow.refusal == "");
    CHECK(says(slow,
               "the scene is compiled for 10000 Hz, and the device delivers at most 1000 reports a "
               "second, one every 1 ms: gains, passes and errors are those of 1000 Hz; compile it "
               "with [loop] rate_hz = 1000, or take a device that reports every 0.1 ms"));
    CHECK(says(slow, "reports every 1 ms and the loop ticks every 0.1 ms"));
    CHECK_FALSE(says(slow, "and the loop ticks at"));
    // A device that could, on a bus that does not ask as often.
    c.report_period_ns = 100'000;
    CHECK_FALSE(says(fit_of(q, c), "delivers at most"));
    c.bus_interval_ns = 125'000;
    CHECK(says(fit_of(q, c), "at most 8000 reports a second, one every 0.125 ms by its bInterval"));
    CHECK(says(fit_of(q, c), "reports every 0.125 ms and the loop ticks every 0.1 ms"));
    // There would be no report to tick at.
    q.report_clocked = true;
    CHECK(fit_of(q, c).refusal.find("to tick at each report, 10000 Hz, and the device delivers at "
                                    "most 8000 reports") != std::string::npos);
    CHECK(fit_of(q, c).refusal.find("give [loop] rate_hz = 8000, or clocking = \"timer\"") !=
          std::string::npos);
    q.loop_period_ns = 125'000;
    CHECK(fit_of(q, c).refusal == "");
  }

  TEST_CASE("a loop at another rate than the scene was compiled for is said") {
    FitQuestion q = modest_question();
    q.scene.rate_hz = 250;
    CHECK(
        says(fit_of(q, stated_device()),
             "the scene is compiled for 250 Hz and the loop ticks at 1000 Hz; give [loop] rate_hz "
             "= 250, or compile the scene with [loop] rate_hz = 1000"));
    q.scene.rate_hz = 1000;
    CHECK_FALSE(says(fit_of(q, stated_device()), "the loop ticks at"));
  }

  TEST_CASE("stiffness and damping that the device states as its largest: refused with numbers") {
    hal::DeviceCapabilities c = stated_device();
    FitQuestion q = modest_question();
    c.max_stiffness_n_per_m = 700;
    CHECK(fit_of(q, c).refusal.find("a stiffness of 800 N/m, more than the 700") !=
          std::string::npos);
    q.accept_unbudgeted = true;  // no matter of the budget
    CHECK(fit_of(q, c).refusal != "");
    q.accept_unbudgeted = false;
    q.scale = 0.9;  // 648 N/m at the device
    CHECK(fit_of(q, c).refusal == "");
    c.max_damping_ns_per_m = 0.5_r;
    CHECK(fit_of(q, c).refusal.find("a damping of 0.81 N s/m at [workspace] scale 0.9") !=
          std::string::npos);
    c.max_damping_ns_per_m = 0;
    c.max_stiffness_n_per_m = 1500;
    q = modest_question();
    q.scene.law = LawId::kPaper;
    q.scene.k_f_n_per_m = 800;  // twice in a slot
    CHECK(fit_of(q, c).refusal.find("a stiffness of 1600 N/m") != std::string::npos);
  }

  TEST_CASE("a scene of another device, and a workspace that is not reached, are said") {
    FitQuestion q = modest_question();
    q.scene.device.given = 1;
    q.scene.device.mass_kg = 0.1;
    q.scene.device.damping_ns_per_m = 5;
    q.scene.device.max_force_n = 12;
    const FitAnswer other = fit_of(q, stated_device());
    CHECK(says(other, "budgeted for another device: mass_kg 0.1 there, 0.2 here"));
    CHECK_FALSE(says(other, "max_force_n"));
    q.scene.device.mass_kg = 0.2001;
    CHECK_FALSE(says(fit_of(q, stated_device()), "another device"));

    hal::DeviceCapabilities c = stated_device();
    c.workspace_radius_m = 0.04_r;
    q.scene.envelope.given = kWorkspaceGiven;
    q.scene.envelope.max_m[1] = 0.2;
    CHECK(says(fit_of(q, c), "[workspace] scale = 2.5 would reach it"));
    q.scale = 2.5;
    CHECK_FALSE(says(fit_of(q, c), "would reach it"));
  }

  TEST_CASE("an advised scale holds with the digits that it is printed with") {
    const auto advised = [](const std::string& text) {
      const std::string key = "[workspace] scale = ";
      const std::size_t at = text.find(key);
      REQUIRE(at != std::string::npos);
      return std::stod(text.substr(at + key.size()));
    };
    int rounded = 0;
    for (int k = 0; k < 40; ++k) {
      CAPTURE(k);
      FitQuestion reach = modest_question();
      hal::DeviceCapabilities c = stated_device();
      c.workspace_radius_m = 0.04_r;
      reach.scene.envelope.given = kWorkspaceGiven;
      reach.scene.envelope.max_m[1] = 0.2 + 0.001237 * k;
      std::string note;
      for (const std::string& text : fit_of(reach, c).notes)
        if (text.find("would reach it") != std::string::npos) note = text;
      reach.scale = advised(note);
      CHECK_FALSE(says(fit_of(reach, c), "would reach it"));

      FitQuestion stiff = modest_question();
      stiff.accept_unbudgeted = true;
      c.max_stiffness_n_per_m = 700 - static_cast<Real>(1.37 * k);
      const std::string refusal = fit_of(stiff, c).refusal;
      stiff.scale = advised(refusal);
      CHECK(fit_of(stiff, c).refusal == "");
      const double exact = std::sqrt((700 - 1.37 * k) / 800);
      rounded += std::abs(stiff.scale - exact) > 1e-9 ? 1 : 0;
      CHECK(stiff.scale == doctest::Approx(exact).epsilon(1.1e-3));
    }
    CHECK(rounded > 30);
  }

  TEST_CASE("a device without motors fits everything") {
    hal::DeviceCapabilities c;
    c.sensed_dof = hal::kDofAll;
    FitQuestion q = modest_question();
    q.scene.coupling.k_t_n_per_m = 1e6;
    CHECK(fit_of(q, c).refusal == "");
    CHECK(fit_of(q, c).notes.empty());
  }

  TEST_CASE("the gate asks at each connection, and has each set of notes told once") {
    FitQuestion q = modest_question();
    SafetyLimits limits;
    limits.slew_n_per_s = 100;
    DeviceGate gate(q, limits);
    CHECK(gate.admit(stated_device()) == "");
    const std::vector<std::string> notes = gate.take_notes();
    REQUIRE(notes.size() == 2);
    // A ramp of 10 ms, half the watchdog, at the configured slew.
    CHECK(notes[1] == "sent to this device: at most 1 N, 0.05 N m, 100 N/s, 10 N m/s");
    CHECK(gate.take_notes().empty());
    CHECK(gate.admit(stated_device()) == "");
    CHECK(gate.take_notes().empty());
    hal::DeviceCapabilities weak = stated_device();
    weak.max_stiffness_n_per_m = 100;
    const std::string refusal = gate.admit(weak);
    CHECK(refusal != "");
    CHECK(gate.refusal() == refusal);
    CHECK(gate.admit(stated_device()) == "");
    CHECK(gate.refusal() == "");
  }

  TEST_CASE("a machine in time gets all; late or not granted, a half or a period's worth") {
    constexpr std::int64_t kPeriod_ns = 1'000'000;
    MachineFit m = machine_fit(woken(250'000), kPeriod_ns, true);
    CHECK(m.fit);
    CHECK(m.share == 1.0);
    CHECK(m.found.find("2000 wake-ups") != std::string::npos);
    CHECK(m.found.find("largest 250 us late") != std::string::npos);
    m = machine_fit(woken(251'000), kPeriod_ns, true);
    CHECK_FALSE(m.fit);
    CHECK(m.share == 0.5);
    m = machine_fit(woken(100'000), kPeriod_ns, false);
    CHECK_FALSE(m.fit);
    CHECK(m.share == 0.5);
    m = machine_fit(woken(8'000'000), kPeriod_ns, true);
    CHECK(m.share == doctest::Approx(0.125));
    CHECK_FALSE(machine_fit(hal::WakeupMeasurement{}, kPeriod_ns, true).fit);
    hal::WakeupMeasurement broken = woken(1000);
    broken.error = 5;
    CHECK_FALSE(machine_fit(broken, kPeriod_ns, true).fit);

    SafetyLimits limits;
    limits.max_axis_force_n = Vec3(2, 0, 1);
    const SafetyLimits low = lowered(limits, 0.5);
    CHECK(low.max_force_n == 0.5_r * limits.max_force_n);
    CHECK(low.max_torque_nm == 0.5_r * limits.max_torque_nm);
    CHECK(low.max_axis_force_n == Vec3(1, 0, 0.5_r));
    CHECK(low.slew_n_per_s == limits.slew_n_per_s);
  }
}
