// SPDX-License-Identifier: Apache-2.0
// Parts led into their holes: what the table measures, on ways whose result is known.
#include <doctest/doctest.h>

#include "host_sim/lab/studies/pegs/peg_table.hpp"

using namespace haptic;
using namespace haptic::sim;

namespace {

const PegTask& task_of(const std::vector<PegTask>& tasks, const std::string& name) {
  for (const PegTask& task : tasks) {
    if (task.name == name) return task;
  }
  FAIL("no task ", name);
  return tasks.front();
}

}  // namespace

TEST_SUITE("host_sim.pegs") {
  TEST_CASE("straight in: both laws give the push against the floor, and nothing is held") {
    const std::vector<PegTask> tasks = peg_tasks(true);
    for (const char* name : {"4_100um_10mm_straight", "12_100um_10mm_straight"}) {
      for (const LawId law : {LawId::kPaper, LawId::kProxy}) {
        const PegResult r = run_peg_task(task_of(tasks, name), peg_devices().front(), law);
        CAPTURE(name);
        CHECK(r.largest_n == doctest::Approx(2.0).epsilon(1e-3));  // 2 mm at 1000 N/m
        CHECK(r.force_step_n == doctest::Approx(0.05).epsilon(1e-3));
        CHECK(r.torque_step_nm < 1e-6);
        CHECK(r.longest_hold == 0);
        CHECK_FALSE(r.outlasts);
      }
    }
  }

  TEST_CASE("led over the rim: the hold is seen, it ends, and no limit of a device is passed") {
    const std::vector<PegTask> tasks = peg_tasks(true);
    std::size_t holding = 0;
    for (const PegDevice& device : peg_devices()) {
      const PegResult r =
          run_peg_task(task_of(tasks, "4_100um_10mm_over_the_rim"), device, LawId::kProxy);
      CAPTURE(device.name);
      holding += r.longest_hold > 5 ? 1 : 0;
      CHECK_FALSE(r.outlasts);
      // The passivity layer's damper may come on top.
      if (device.device.max_force_n > 0) CHECK(r.largest_n <= 1.01 * device.device.max_force_n);
    }
    // The peg stands on the rim in balance: in single precision it tips into the hole under one of
    // the devices, and in double precision under none, before the hand is where it would be free.
    CHECK(holding >= peg_devices().size() - (HAPTIC_REAL_IS_FLOAT ? 1 : 0));
  }

  TEST_CASE("verdict: larger steps, another strength and a hold that stays are each seen") {
    PegResult paper, proxy;
    paper.device = proxy.device = "none";
    proxy.law = LawId::kProxy;
    paper.median_n = proxy.median_n = 2;
    paper.force_step_n = proxy.force_step_n = 1;
    paper.torque_step_nm = proxy.torque_step_nm = 0.01;
    CHECK(verdict_of({paper, proxy}).passed());
    PegResult worse = proxy;
    worse.force_step_n = 1.01;
    CHECK_FALSE(verdict_of({paper, worse}).passed());
    worse = proxy;
    worse.torque_step_nm = 0.0101;
    CHECK_FALSE(verdict_of({paper, worse}).passed());
    worse = proxy;
    worse.median_n = 3.1;
    CHECK_FALSE(verdict_of({paper, worse}).passed());
    worse.median_n = 0.9;
    CHECK_FALSE(verdict_of({paper, worse}).passed());
    worse = proxy;
    worse.device = "another";
    worse.outlasts = true;
    CHECK_FALSE(verdict_of({paper, proxy, worse}).passed());
  }
}
