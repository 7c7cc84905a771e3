// SPDX-License-Identifier: Apache-2.0
// The checks of the verification can fail: each of three faults put into the core's memory on
// purpose is caught, and nothing is reported without it.
#include <doctest/doctest.h>

#include <string>

#include "host_sim/lab/verification/deliberate_fault.hpp"
#include "rt_core/base/scalar.hpp"
#include "tests/support/program_run.hpp"

using namespace haptic::sim;
using namespace haptic::sim::test;

namespace {

/// A micrometre is within the rounding that bounds are widened by in single precision.
constexpr bool kMicrometreCounts = sizeof(haptic::Real) == sizeof(double);

void check_caught(DeliberateFault fault) {
  constexpr std::uint64_t kSeed = 3;
  const FaultOutcome outcome = run_with_fault(fault, kSeed);
  INFO("seed " << kSeed << ": " << outcome.first_failure);
  CHECK(outcome.checks > 0);
  CHECK(outcome.sound_failures == 0);
  CHECK(outcome.fault_failures > 0);
  CHECK(outcome.caught());
  CHECK_FALSE(outcome.first_failure.empty());
}

}  // namespace

TEST_SUITE("host_sim.verify_faults") {
  TEST_CASE("a face's bound one micrometre too low hides the face: nodes are missing") {
    if (kMicrometreCounts) check_caught(DeliberateFault::kKey);
  }

  TEST_CASE("an arc removed from the graph: the walk over a face misses nodes") {
    check_caught(DeliberateFault::kArc);
  }

  TEST_CASE("a support table with a wrong entry: certificates and verdicts fail") {
    check_caught(DeliberateFault::kSupport);
  }

  TEST_CASE("program: a caught fault is exit 1, with the case that failed") {
    for (const std::string fault : {"key", "arc", "support"}) {
      if (fault == "key" && !kMicrometreCounts) continue;
      const ProgramResult run = run_program(HAPTIC_HOST_SIM, "verify --fault " + fault);
      INFO(fault << ": " << run.out << run.err);
      CHECK(run.exit_code == 1);
      CHECK(run.out.find(" 0 fail without it") != std::string::npos);
      CHECK(run.out.find("the fault was not caught") == std::string::npos);
      CHECK(run.out.find("at p = (") != std::string::npos);
    }
  }
}
