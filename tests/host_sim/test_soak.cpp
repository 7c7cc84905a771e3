// SPDX-License-Identifier: Apache-2.0
// The soak in virtual time: what it must pass, and each probe that it must find.
#include <doctest/doctest.h>

#include <set>
#include <utility>

#include "host_sim/lab/realtime/soak_run.hpp"

namespace haptic::sim {
namespace {

/// So long that power lost and an unplug come after the warm-up.
constexpr double kMinutes = 0.5, kEvery_s = 3.0;

SoakAccount soak_with(SoakProbe probe) {
  SoakSettings settings;
  settings.minutes = kMinutes;
  settings.every_s = kEvery_s;
  settings.virtual_time = true;
  settings.probe = probe;
  return run_soak(fault_scene(), fault_place(), settings, [](const SoakAccount&) {});
}

bool some_failure_says(const SoakAccount& account, const std::string& words) {
  for (const std::string& failure : account.failures) {
    if (failure.find(words) != std::string::npos) return true;
  }
  return false;
}

}  // namespace

TEST_SUITE("host_sim.soak") {
  TEST_CASE("in virtual time: every fault answered as stated, nothing grows") {
    const SoakAccount account = soak_with(SoakProbe::kNone);
    for (const std::string& failure : account.failures) MESSAGE(failure);
    CHECK(account.failures.empty());
    CHECK(account.cells.size() == 10u);
    CHECK(account.repeated == 0u);
    CHECK(account.machine_faults == 0u);
    CHECK(account.samples.size() >= 30u);
    CHECK(account.descriptors.reference > 0);
  }

  TEST_CASE("what is wrong with the soak itself is found") {
    CHECK(some_failure_says(soak_with(SoakProbe::kLeakMemory), "the heap in use grows"));
    CHECK(some_failure_says(soak_with(SoakProbe::kLeakDescriptor), "descriptors changes"));
    CHECK(some_failure_says(soak_with(SoakProbe::kIgnoreFault), "unplug in flight"));
  }

  TEST_CASE("the plan meets every fault in full contact and every pair with the other states") {
    const std::size_t faults_there = faults().size() - 1;
    std::set<std::pair<const Fault*, FaultState>> met;
    for (const FaultCase& cell : soak_plan(2 * 6 * faults_there))
      met.insert({cell.fault, cell.state});
    CHECK(met.size() == 7 * faults_there);
  }
}

}  // namespace haptic::sim
