// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "hal/usb/link_faults.hpp"

using namespace haptic;
using namespace haptic::hal;

namespace {

constexpr std::int64_t kMs = 1'000'000;

DeviceCommand answer_to(std::uint64_t sequence) {
  DeviceCommand command;
  command.tick = 1;
  command.sequence = sequence;
  return command;
}

}  // namespace

TEST_SUITE("hal.link_faults") {
  TEST_CASE("silence: from the last valid report; bad ones do not count as life, frozen ones do") {
    LinkFaults f({20 * kMs, 1000, 1000});
    f.begin(0);
    f.check_silence(20 * kMs);
    CHECK(f.shown() == 0u);
    f.note(ReportVerdict::kBadCheck, 15 * kMs);
    f.check_silence(21 * kMs);
    CHECK(f.shown() == kLinkSilent);
    f.note(ReportVerdict::kNotAdvancing, 22 * kMs);
    f.check_silence(40 * kMs);
    CHECK(f.present() == 0u);
  }

  TEST_CASE("silence of a slow device: three of the reports that it states") {
    LinkFaults f({20 * kMs, 1000, 1000});
    f.begin(0);
    f.expect_reports_every(15 * kMs);
    f.check_silence(45 * kMs);
    CHECK(f.shown() == 0u);
    f.check_silence(45 * kMs + 1);
    CHECK(f.shown() == kLinkSilent);
    f.begin(100 * kMs);
    f.expect_reports_every(1 * kMs);  // a fast one, or one that states nothing: the limit
    f.check_silence(121 * kMs);
    CHECK(f.present() == kLinkSilent);
    f.begin(200 * kMs);
    f.expect_reports_every(0);
    f.check_silence(220 * kMs);
    CHECK(f.present() == 0u);
  }

  TEST_CASE("corrupt and frozen: only so many in a row, and one good report ends it") {
    LinkFaults f({1000 * kMs, 3, 4});
    f.begin(0);
    for (const ReportVerdict bad :
         {ReportVerdict::kBadLength, ReportVerdict::kBadCheck, ReportVerdict::kState,
          ReportVerdict::kBadNumber, ReportVerdict::kBadCheck})
      f.note(bad, kMs);
    CHECK(f.shown() == 0u);
    f.note(ReportVerdict::kBadLength, kMs);
    CHECK(f.present() == kLinkCorrupt);
    f.note(ReportVerdict::kNothing, kMs);
    CHECK(f.present() == 0u);
    for (int k = 0; k < 3; ++k) f.note(ReportVerdict::kNotAdvancing, kMs);
    CHECK(f.present() == 0u);
    f.note(ReportVerdict::kNotAdvancing, kMs);
    CHECK(f.present() == kLinkFrozen);
  }

  TEST_CASE("shown: until a command has answered a state that carried it") {
    LinkFaults f({1000 * kMs, 1, 10});
    f.begin(0);
    f.note(ReportVerdict::kBadCheck, kMs);
    f.note(ReportVerdict::kState, 2 * kMs);
    CHECK(f.present() == 0u);
    f.answered(answer_to(1000));  // nothing has gone out yet that it could have known of
    CHECK(f.shown() == kLinkCorrupt);
    f.carried(7);
    f.carried(8);
    f.answered(answer_to(6));
    CHECK(f.shown() == kLinkCorrupt);
    f.answered(DeviceCommand{});
    CHECK(f.shown() == kLinkCorrupt);
    f.answered(answer_to(7));
    CHECK(f.shown() == 0u);
  }

  TEST_CASE("shown: a cause that is still there stays, however often it is answered") {
    LinkFaults f({1000 * kMs, 1, 10});
    f.set_present(kLinkServoLost, true);
    f.carried(1);
    f.answered(answer_to(5));
    CHECK(f.shown() == kLinkServoLost);
    f.set_present(kLinkServoLost, false);
    f.answered(answer_to(6));
    CHECK(f.shown() == 0u);
  }
}
