// SPDX-License-Identifier: Apache-2.0
// What a session is judged by, tick by tick, and its line.
#include <doctest/doctest.h>

#include <cmath>
#include <functional>
#include <string>

#include "tools/verdict/session_judge.hpp"
#include "tools/verdict/verdict_json.hpp"

using namespace haptic;
using namespace haptic::tools;

namespace {

/// `count` ticks of one kind.
void take(SessionJudge& judge, std::uint64_t count, const JudgedTick& tick) {
  for (std::uint64_t k = 0; k < count; ++k) judge.take(tick);
}

JudgedTick free_tick() { return {}; }
JudgedTick pressed_tick(double pull_n = 2) { return {false, true, pull_n}; }
JudgedTick open_tick(double pull_n = 2) { return {false, false, pull_n}; }
JudgedTick flagged_tick(std::uint32_t flags) { return {false, true, 2, flags}; }

std::string line_of(const SessionJudge& judge) {
  return std::string(verdict_line(judge.verdict()).view());
}

std::uint64_t count_of(const SessionVerdict& v, WhyNot why) {
  return v.why_not[static_cast<std::size_t>(why)];
}

}  // namespace

TEST_SUITE("tools.session_judge") {
  TEST_CASE("free and pressed ticks follow the hand; nothing fails") {
    SessionJudge judge;
    take(judge, 700, free_tick());
    take(judge, 300, pressed_tick());
    const SessionVerdict v = judge.verdict();
    CHECK(v.outcome == Outcome::kFollowed);
    CHECK_FALSE(v.failed());
    CHECK(v.ticks == 1000);
    CHECK(v.followed_ticks == 1000);
    CHECK(v.contact_ticks == 300);
    CHECK(std::isnan(v.given_out_j));
    CHECK(line_of(judge) == "followed the hand in all 1000 ticks");
  }

  TEST_CASE("no tick is no failure, and is said") {
    const SessionJudge judge;
    CHECK(judge.verdict().outcome == Outcome::kNoTicks);
    CHECK_FALSE(judge.verdict().failed());
    CHECK(line_of(judge) == "no tick was made");
  }

  TEST_CASE("force without contact fails from the 101st tick in a row on") {
    SessionJudge judge;
    take(judge, 10, free_tick());
    take(judge, 100, open_tick(13.223));
    judge.take(pressed_tick());
    take(judge, 100, open_tick(1));
    CHECK_FALSE(judge.verdict().failed());
    judge.take(open_tick(1.5));
    const SessionVerdict v = judge.verdict();
    CHECK(v.outcome == Outcome::kForceInTheOpen);
    CHECK(v.longest_open.begin == 111);
    CHECK(v.longest_open.ticks == 101);
    // Of the run that fails, not of the shorter one before.
    CHECK(v.open_force_n == doctest::Approx(1.5));
    CHECK(line_of(judge).starts_with(
        "FAILED: force without contact: up to 1.50 N for 101 ticks in a row from tick 111 on"));
  }

  TEST_CASE("0.05 N, a ramp, recovery or the clutch is no force without contact") {
    for (const JudgedTick& tick : {open_tick(0.05), JudgedTick{false, false, 5, kFlagRamping},
                                   JudgedTick{false, false, 5, kFlagClutched | kFlagRamping},
                                   JudgedTick{true, false, 5, 0}}) {
      SessionJudge judge;
      take(judge, 1000, tick);
      CHECK_FALSE(judge.verdict().has(Outcome::kForceInTheOpen));
    }
  }

  TEST_CASE("stuck fails from the 101st tick in a row on") {
    SessionJudge judge;
    take(judge, 100, flagged_tick(kFlagProxyStuck));
    judge.take(pressed_tick());
    CHECK_FALSE(judge.verdict().failed());
    take(judge, 101, flagged_tick(kFlagProxyStuck));
    CHECK(judge.verdict().outcome == Outcome::kStuck);
    CHECK(judge.verdict().longest_stuck.begin == 101);
    CHECK(count_of(judge.verdict(), WhyNot::kStuck) == 201);
    CHECK(line_of(judge).find("stuck while free to move for 101 ticks in a row from tick 101") !=
          std::string::npos);
  }

  TEST_CASE("recovery that ends is said; one that does not fails") {
    SessionJudge judge;
    take(judge, 400, flagged_tick(kFlagRecovery | kFlagRamping));
    CHECK(judge.verdict().outcome == Outcome::kInside);
    CHECK(judge.verdict().inside_to_end == 400);
    take(judge, 600, pressed_tick());
    const SessionVerdict v = judge.verdict();
    CHECK_FALSE(v.failed());
    CHECK(v.started_inside);
    CHECK(count_of(v, WhyNot::kInside) == 400);
    CHECK(line_of(judge) ==
          "followed the hand in 60.0 % of 1000 ticks; 400 ticks inside an obstacle, without force, "
          "from the start: give [moving] position_m a free place; 400 ticks with the force ramped");
  }

  TEST_CASE("behind fails above 1 % of the ticks, and above 10 of them") {
    SessionJudge judge;
    take(judge, 10, flagged_tick(kFlagBehind));
    take(judge, 90, pressed_tick());
    CHECK_FALSE(judge.verdict().failed());
    judge.take(flagged_tick(kFlagBehind));
    CHECK(judge.verdict().outcome == Outcome::kBehind);
    take(judge, 1000, pressed_tick());
    CHECK_FALSE(judge.verdict().failed());
    take(judge, 1, flagged_tick(kFlagBehind));
    CHECK(judge.verdict().outcome == Outcome::kBehind);
  }

  TEST_CASE("energy given out fails above 1 mJ, and comes first") {
    SessionJudge judge;
    take(judge, 200, open_tick());
    judge.note_work(-1);
    CHECK(judge.verdict().given_out_j == 0);
    judge.note_work(0.001);
    CHECK_FALSE(judge.verdict().has(Outcome::kEnergy));
    judge.note_work(2.46);
    judge.note_work(0.5);
    CHECK(judge.verdict().given_out_j == 2.46);
    CHECK(judge.verdict().outcome == Outcome::kEnergy);
    CHECK(judge.verdict().has(Outcome::kForceInTheOpen));
    CHECK(line_of(judge).starts_with("FAILED: the rendering gave out 2460.0 mJ: give the scene"));
  }

  TEST_CASE("a motion that touches nothing fails where it was made to touch") {
    SessionJudge judge;
    take(judge, 50, free_tick());
    CHECK_FALSE(judge.verdict().failed());
    CHECK(line_of(judge) == "followed the hand in all 50 ticks; the part touched nothing");
    judge.expect_contact();
    CHECK(judge.verdict().outcome == Outcome::kNothingTouched);
    CHECK(line_of(judge).starts_with("FAILED: the motion touches nothing: give [moving]"));
    judge.take(pressed_tick());
    CHECK_FALSE(judge.verdict().failed());
  }

  TEST_CASE("every reason takes its tick from those that followed") {
    const std::pair<std::uint32_t, WhyNot> reasons[] = {
        {kFlagRecovery, WhyNot::kInside},  {kFlagOutsideEnvelope, WhyNot::kOutside},
        {kFlagProxyStuck, WhyNot::kStuck}, {kFlagListFull, WhyNot::kListFull},
        {kFlagBehind, WhyNot::kBehind},    {kFlagSaturated, WhyNot::kSaturated},
        {kFlagRamping, WhyNot::kRamped}};
    for (const auto& [flag, why] : reasons) {
      const auto reason = to_text(why);
      CAPTURE(reason);
      SessionJudge judge;
      take(judge, 99, pressed_tick());
      judge.take(flagged_tick(flag));
      CHECK(judge.verdict().followed_ticks == 99);
      CHECK(count_of(judge.verdict(), why) == 1);
      CHECK(line_of(judge).starts_with("followed the hand in 99.0 % of 100 ticks; 1 tick "));
    }
    // What says nothing of the hand.
    SessionJudge judge;
    judge.take(flagged_tick(kFlagProxyLimited | kFlagHooked | kFlagPassivity | kFlagFirstTick));
    CHECK(judge.verdict().followed_ticks == 1);
  }

  TEST_CASE("nearly all is never told as all, and 100.0 % never as a part") {
    SessionJudge judge;
    take(judge, 9'999, pressed_tick());
    judge.take(flagged_tick(kFlagSaturated));
    CHECK(line_of(judge) ==
          "followed the hand in 99.9 % of 10000 ticks; 1 tick with the pull at its limit");
  }

  TEST_CASE("a failure that the program has found besides stands first") {
    SessionJudge judge;
    take(judge, 20, pressed_tick());
    CHECK(verdict_line(judge.verdict(), "the link is not ready").view() ==
          "FAILED: the link is not ready; followed the hand in all 20 ticks");
    take(judge, 200, open_tick());
    CHECK(verdict_line(judge.verdict(), "the link is not ready")
              .view()
              .starts_with("FAILED: the link is not ready; force without contact"));
  }

  TEST_CASE("reset forgets the ticks; two sessions add up") {
    SessionJudge judge;
    take(judge, 200, open_tick());
    const SessionVerdict first = judge.verdict();
    judge.reset();
    CHECK(judge.verdict().ticks == 0);
    take(judge, 300, pressed_tick());
    SessionVerdict both = first;
    add(judge.verdict(), both);
    CHECK(both.ticks == 500);
    CHECK(both.contact_ticks == 300);
    CHECK(both.outcome == Outcome::kForceInTheOpen);
    SessionVerdict only;
    add(judge.verdict(), only);
    CHECK(only.outcome == Outcome::kFollowed);
    CHECK(only.ticks == 300);
  }

  TEST_CASE("JSON has every count, and text as the line") {
    SessionJudge judge;
    take(judge, 60, flagged_tick(kFlagBehind));
    const auto json = verdict_json(judge.verdict(), line_of(judge));
    CHECK(json["outcome"] == "behind");
    CHECK(json["failures"].size() == 1);
    CHECK(json["behind_ticks"] == 60);
    CHECK(json["followed_ticks"] == 0);
    CHECK(json["given_out_j"].is_null());
    CHECK(json["text"] == line_of(judge));
  }

  TEST_CASE("contact is of the part as it is felt") {
    StepResult result;
    result.d_near_m = -0.001_r;
    CHECK_FALSE(felt_part_touches(result, LawId::kProxy));
    CHECK(felt_part_touches(result, LawId::kPaper));
    result.d_near_m = 0.001_r;
    result.situation = ContactSituation::kFaceFace;
    CHECK(felt_part_touches(result, LawId::kProxy));
    result.status = RtStatus::kPoseNotUnit;
    CHECK_FALSE(felt_part_touches(result, LawId::kProxy));
    CHECK(judged_tick(result, LawId::kProxy).refused);
  }
}
