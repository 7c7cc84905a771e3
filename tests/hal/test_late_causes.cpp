// SPDX-License-Identifier: Apache-2.0
// Why a tick was late: by its moments alone, no clock.
#include <doctest/doctest.h>

#include <string_view>

#include "hal/realtime/late_causes.hpp"

using namespace haptic;
using namespace haptic::hal;

namespace {

constexpr std::int64_t kPeriod_ns = 100'000;

/// Ticks at 10 kHz, one after the other, with a report just before each.
struct LateTicks {
  LateJudge judge;
  std::int64_t due_ns = 10 * kPeriod_ns, report_ns = 0;
  std::uint64_t sequence = 0;
  bool report_clocked;

  explicit LateTicks(bool by_reports = false)
      : judge(kPeriod_ns, by_reports), report_clocked(by_reports) {}

  /// The next one: woken late by so much, of that length and that work (negative: not known).
  LateCause tick(std::int64_t late_ns, std::int64_t tick_ns, std::int64_t work_ns = -1,
                 bool reported = true) {
    due_ns += kPeriod_ns;
    if (reported) {
      sequence += 1;
      report_ns = report_clocked ? due_ns : due_ns - 10'000;
    }
    ServoInput input;
    input.state.sequence = sequence;
    input.state.stamp_ns = report_ns;
    input.state.limits.report_period_ns = kPeriod_ns;
    input.now_ns = due_ns + late_ns;
    judge.begin(input, late_ns);
    return judge.end(tick_ns, work_ns);
  }
};

}  // namespace

TEST_SUITE("hal.late_causes") {
  TEST_CASE("a tick that is over before its period is has no cause") {
    LateTicks t;
    CHECK(t.tick(5'000, 30'000) == LateCause::kInTime);
    CHECK(t.tick(60'000, 40'000) == LateCause::kInTime);  // to the nanosecond
    CHECK(t.tick(60'000, 40'001) != LateCause::kInTime);
  }

  TEST_CASE("each delay has its cause: the machine before and within, the work, both") {
    LateTicks woken, worked, held, both;
    CHECK(woken.tick(90'000, 30'000) == LateCause::kWakeUp);
    CHECK(worked.tick(5'000, 110'000) == LateCause::kTick);
    CHECK(held.tick(5'000, 400'000, 30'000) == LateCause::kHeldUp);
    CHECK(both.tick(40'000, 70'000) == LateCause::kTogether);
    // However late it was woken: its work alone would not have been in time.
    LateTicks worst;
    CHECK(worst.tick(500'000, 101'000) == LateCause::kTick);
    CHECK(worst.tick(0, 20'000) == LateCause::kInTime);
  }

  TEST_CASE("a tick that waits for the one before has the cause of that one") {
    LateTicks worked, held, woken;
    CHECK(worked.tick(0, 190'000) == LateCause::kTick);
    CHECK(worked.tick(90'000, 30'000) == LateCause::kTick);
    CHECK(worked.tick(20'000, 30'000) == LateCause::kInTime);
    CHECK(held.tick(0, 190'000, 30'000) == LateCause::kHeldUp);
    CHECK(held.tick(90'000, 30'000, 30'000) == LateCause::kHeldUp);
    CHECK(woken.tick(95'000, 95'000) == LateCause::kWakeUp);
    CHECK(woken.tick(90'000, 30'000) == LateCause::kWakeUp);
    CHECK(woken.tick(20'000, 30'000) == LateCause::kInTime);
  }

  TEST_CASE("a report that is two periods old or more is late, and a late tick is not also that") {
    LateTicks t;
    CHECK(t.tick(0, 30'000) == LateCause::kInTime);
    CHECK(t.tick(0, 30'000, -1, false) == LateCause::kInTime);
    CHECK(t.tick(0, 30'000, -1, false) == LateCause::kReport);
    CHECK(t.tick(95'000, 30'000, -1, false) == LateCause::kWakeUp);
    CHECK(t.tick(25'000, 30'000) == LateCause::kInTime);
    // A device that reports more slowly than the loop ticks is not late for that.
    LateJudge judge(kPeriod_ns, false);
    ServoInput input;
    input.state.sequence = 1;
    input.state.stamp_ns = 1;
    input.state.limits.report_period_ns = 10 * kPeriod_ns;
    input.now_ns = 19 * kPeriod_ns;
    judge.begin(input, 0);
    CHECK(judge.end(30'000) == LateCause::kInTime);
    input.now_ns = 20 * kPeriod_ns + 1;
    judge.begin(input, 0);
    CHECK(judge.end(30'000) == LateCause::kReport);
    // Before the first report nothing is late.
    LateTicks none;
    CHECK(none.tick(0, 30'000, -1, false) == LateCause::kInTime);
  }

  TEST_CASE("clocked by reports: a tick without one, or after a gap, is the report's") {
    LateTicks t(true);
    CHECK(t.tick(4'000, 30'000) == LateCause::kInTime);
    CHECK(t.tick(4'000, 30'000) == LateCause::kInTime);
    CHECK(t.tick(50'000, 30'000, -1, false) == LateCause::kReport);
    CHECK(t.tick(4'000, 30'000) == LateCause::kReport);
    CHECK(t.tick(4'000, 30'000) == LateCause::kInTime);
    CHECK(t.tick(90'000, 30'000) == LateCause::kWakeUp);
    CHECK(t.tick(4'000, 120'000) == LateCause::kTick);
  }

  TEST_CASE("every cause has a name of its own") {
    for (std::size_t k = 0; k < kLateCauses; ++k) {
      for (std::size_t l = 0; l < k; ++l)
        CHECK(std::string_view(to_text(static_cast<LateCause>(k))) !=
              to_text(static_cast<LateCause>(l)));
    }
    CHECK(std::string_view(to_text(LateCause::kCount)) == "unknown");
  }
}
