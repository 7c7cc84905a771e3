// SPDX-License-Identifier: Apache-2.0
// What a guide must not do, and that the check of it fails where a guide does.
#include <doctest/doctest.h>

#include "host_sim/lab/studies/planning/guide_limits.hpp"

using namespace haptic::sim;

namespace {

GuideLimits quick_limits(std::uint64_t ticks, GuideFault fault) {
  GuideLimitsOptions options;
  options.quick = true;
  options.ticks = ticks;
  options.fault = fault;
  return run_guide_limits(options);
}

void check_limits(const GuideLimitsOptions& options) {
  const GuideLimits limits = run_guide_limits(options);
  for (const GuideCell& cell : limits.cells) {
    CAPTURE(cell.setting.rate_hz);
    CAPTURE(cell.setting.hand);
    CAPTURE(cell.setting.delay_samples);
    CAPTURE(cell.setting.damping_ns_per_m);
    CAPTURE(cell.at_goal);
    CHECK(cell.with_n_per_m >= cell.without_n_per_m);
  }
  CHECK(limits.hostile.most_j <= limits.hostile.stated_j);
  CHECK(limits.passed());
}

}  // namespace

TEST_SUITE("host_sim.guide_limits") {
  TEST_CASE("limits: no cell of the loop is worse with the guide, and it does what it states") {
    GuideLimitsOptions options;
    options.quick = true;
    options.ticks = 50'000;
    check_limits(options);
  }
  TEST_CASE("[long] limits: in all cells, and over 1 000 000 hostile ticks") { check_limits({}); }

  TEST_CASE("limits: a guide that is too strong is found worse") {
    const GuideLimits limits = quick_limits(1000, GuideFault::kStiff);
    bool worse = false;
    for (const GuideCell& cell : limits.cells) worse = worse || cell.worse();
    CHECK(worse);
    CHECK_FALSE(limits.passed());
  }

  TEST_CASE("limits: a guide that does more than is stated is found") {
    const GuideLimits limits = quick_limits(50'000, GuideFault::kEnergy);
    CHECK(limits.hostile.most_j > limits.hostile.stated_j);
    CHECK_FALSE(limits.passed());
  }
}
