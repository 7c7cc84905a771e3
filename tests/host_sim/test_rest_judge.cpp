// SPDX-License-Identifier: Apache-2.0
// The judge of rest on made-up runs: what it must find, and what it must let pass.
#include <doctest/doctest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "host_sim/device/rest_judge.hpp"

using namespace haptic;
using namespace haptic::sim;

namespace {

constexpr RestAllowance kAllowance{0.05, 0.001};

template <typename Force>
std::vector<LoopRecord> run_of(double moving_s, double seconds, const Force& force) {
  std::vector<LoopRecord> records;
  for (int k = 0; k < static_cast<int>(1000 * seconds); ++k) {
    LoopRecord r;
    r.tick.t_s = 1e-3 * k;
    r.target_m = {r.tick.t_s < moving_s ? r.tick.t_s : moving_s, 0, 0};
    r.tick.force_n[1] = 3.0 + force(r.tick.t_s);
    records.push_back(r);
  }
  return records;
}

double wave(double amplitude, double hertz, double t_s) {
  return amplitude * std::sin(2 * std::numbers::pi * hertz * t_s);
}

}  // namespace

TEST_SUITE("host_sim.rest_judge") {
  TEST_CASE("a wave that goes on is found, with its size and frequency") {
    const auto records = run_of(1, 3, [](double t) { return wave(0.1, 30, t); });
    const RestOscillation rest = rest_oscillation(records, kAllowance);
    CHECK(rest.windows >= 3);
    CHECK(rest.oscillates());
    CHECK(rest.force_pp_n == doctest::Approx(0.2).epsilon(0.05));
    CHECK(rest.frequency_hz == doctest::Approx(30).epsilon(0.1));
    CHECK(rest.ratio == doctest::Approx(4).epsilon(0.05));
  }

  TEST_CASE("one in the torque alone as well") {
    auto records = run_of(1, 3, [](double) { return 0.0; });
    for (LoopRecord& r : records) r.tick.torque_nm[2] = wave(0.002, 80, r.tick.t_s);
    CHECK(rest_oscillation(records, kAllowance).oscillates());
  }

  TEST_CASE("what dies out, drifts, or is as small as the encoder's counts is rest") {
    CHECK_FALSE(
        rest_oscillation(run_of(1, 3, [](double t) { return wave(std::exp(-3 * t), 30, t); }),
                         kAllowance)
            .oscillates());
    CHECK_FALSE(
        rest_oscillation(run_of(1, 3, [](double t) { return t; }), kAllowance).oscillates());
    const RestOscillation counts =
        rest_oscillation(run_of(1, 3, [](double t) { return wave(0.02, 50, t); }), kAllowance);
    CHECK_FALSE(counts.oscillates());
    CHECK(counts.force_pp_n == doctest::Approx(0.04).epsilon(0.05));
  }

  TEST_CASE("a hand that moves is not judged") {
    const RestOscillation rest =
        rest_oscillation(run_of(9, 3, [](double t) { return wave(1, 30, t); }), kAllowance);
    CHECK(rest.windows == 0);
    CHECK_FALSE(rest.oscillates());
  }

  TEST_CASE("the allowance counts the encoder and the coupling, and is never below what is felt") {
    SceneParameters p{};
    p.law = LawId::kProxy;
    p.coupling.k_t_n_per_m = 1000;
    p.coupling.k_r_nm_per_rad = 0.4;
    DeviceModel device;
    CHECK(rest_allowance(p, device).force_n == kStillForce_n);
    device.encoder_step_m = 6e-5;
    CHECK(rest_allowance(p, device).force_n == doctest::Approx(1.5 * std::sqrt(3.0) * 0.06));
    CHECK(rest_allowance(p, device).torque_nm ==
          doctest::Approx(0.02 * rest_allowance(p, device).force_n));
  }
}
