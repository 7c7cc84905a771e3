// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <atomic>

#include "hal/realtime/wakeup_measurement.hpp"

using namespace haptic::hal;

TEST_SUITE("hal.wakeup_measurement") {
  TEST_CASE("count_wakeups: on the calling thread, for as long as asked, or until it is stopped") {
    WakeupQuestion question;
    question.period_ns = 500'000;
    question.duration_ns = 50'000'000;
    std::atomic<bool> stop{false};
    WakeupMeasurement m;
    count_wakeups(question, stop, m);
    CHECK(m.error == 0);
    CHECK(m.priority == 0);  // asked for nothing
    CHECK(m.lateness.count() > 0);
    CHECK(m.lateness.count() + m.missed_periods >= 99);
    CHECK(m.lateness.largest_ns() >= 0);
    stop.store(true);
    question.duration_ns = 3'600'000'000'000;
    count_wakeups(question, stop, m);
    CHECK(m.error == 0);
    CHECK(m.lateness.count() == 0);
  }
}
