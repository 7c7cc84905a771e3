// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "hal/clock/servo_clock.hpp"

using namespace haptic::hal;

TEST_SUITE("hal.servo_clock") {
  TEST_CASE("advance: keeps the phase and counts whole missed periods") {
    DeadlineSchedule s(1000, 100);
    CHECK(s.next_deadline_ns() == 1100);
    CHECK(s.advance(1100) == 0);
    CHECK(s.next_deadline_ns() == 1200);
    CHECK(s.advance(1250) == 0);  // late by half a period
    CHECK(s.last_lateness_ns() == 50);
    CHECK(s.next_deadline_ns() == 1300);
    CHECK(s.advance(1575) == 2);  // late by 2.75 periods: two are gone, none is caught up
    CHECK(s.next_deadline_ns() == 1600);
    CHECK(s.ticks() == 3);
    CHECK(s.missed_periods() == 2);
  }

  TEST_CASE("sleep_until: wakes not before an absolute deadline") {
    const std::int64_t deadline = monotonic_ns() + 2'000'000;
    CHECK(sleep_until(deadline) == 0);
    CHECK(monotonic_ns() >= deadline);
    CHECK(sleep_until(deadline - 1) == 0);  // past: returns at once
  }
}
