// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "host_sim/lab/stability/stability_report.hpp"
#include "host_sim/lab/stability/stability_trial.hpp"
#include "host_sim/session/core_session.hpp"
#include "tests/support/program_run.hpp"
#include "tools/common/error.hpp"

using namespace haptic;
using namespace haptic::sim;

TEST_SUITE("host_sim.stability") {
  TEST_CASE("wall: the loop with the core turns unstable where the spectral radius says") {
    for (const char* hand : {"none", "loose", "firm"}) {
      for (const unsigned delay : {0u, 1u, 2u}) {
        const TrialSetting setting{LawId::kPaper, 1000, delay, hand, 0};
        const double theory = stiffness_limit(linear_loop(setting), 0);
        CAPTURE(hand);
        CAPTURE(delay);
        // Sought from a wrong guess, so that the agreement is found and not handed in.
        CHECK(wall_limit(setting, 1.9 * theory, 2.0) == doctest::Approx(theory).epsilon(0.03));
      }
    }
  }

  TEST_CASE("wall: stable at the budget, unstable at one and a half of it") {
    for (const unsigned delay : {0u, 1u}) {
      const TrialSetting setting{LawId::kPaper, 2000, delay, "none", 0};
      const double budget = closed_form_stiffness(1.0, 1.0 / 2000, delay);
      CHECK(wall_is_stable(setting, budget, 3.0));
      CHECK_FALSE(wall_is_stable(setting, 1.5 * budget, 3.0));
    }
  }

  TEST_CASE(
      "peg: at rest with a soft spring in a firm hand, not with a stiff one in a loose hand") {
    const PegRest soft = peg_rest({LawId::kPaper, 1000, 0, "firm", 0}, 500, 2.5);
    CHECK(soft.at_rest());
    const PegRest stiff = peg_rest({LawId::kPaper, 1000, 2, "loose", 0}, 5000, 1.5);
    CHECK_FALSE(stiff.at_rest());
  }

  TEST_CASE("report: numbered parts, files of their name, stated limits") {
    std::set<int> numbers;
    for (const StabilityPart& part : stability_parts()) {
      CHECK(numbers.insert(part.number).second);
      const bool runs = part.run != nullptr;
      CHECK(runs);
    }
    StabilityOptions options;
    options.quick = true;
    options.laws = {LawId::kPaper};
    const test::ScratchFolder folder("stability");
    CHECK(write_stability(folder.file("three"), {3}, options));
    for (const char* name : {"extreme.csv", "extreme.md", "extreme.svg", "README.md"})
      CHECK(test::text_of_file(folder.file(std::string("three/") + name)).size() > 200);
    CHECK(test::text_of_file(folder.file("three/README.md")).find("| no |") == std::string::npos);
    for (const int gone : {2, 99})
      CHECK_THROWS_AS(static_cast<void>(write_stability(folder.file("none"), {gone}, options)),
                      tools::UsageError);
  }
}
