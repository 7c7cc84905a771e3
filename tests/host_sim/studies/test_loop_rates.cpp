// SPDX-License-Identifier: Apache-2.0
// Why ticks are late, with the stack in its threads and in real time: what is made to go wrong is
// found under its own cause, also on a busy machine. And what passes cost.
#include <doctest/doctest.h>

#include "host_sim/lab/faults/fault_matrix.hpp"
#include "host_sim/lab/laws/law_comparison.hpp"
#include "host_sim/lab/studies/realtime/loop_rates.hpp"
#include "host_sim/lab/studies/realtime/rate_error.hpp"
#include "host_sim/shapes/contact_case.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

constexpr double kTestRate_hz = 500;

std::unique_ptr<RateResult> rate_with(RateFault fault, ReportPath path) {
  CoreSession session(fault_scene(), "rates");
  RateQuestion question;
  question.seconds = 1.0;
  question.fault = fault;
  const auto machine = std::make_unique<hal::WakeupMeasurement>();
  return measure_rate(session, kTestRate_hz, path, question, *machine);
}

/// To the first pose of the case, then along it.
MotionScript motion_of(const ContactCase& contact) {
  MotionScript script;
  const auto add = [&](const char* phase, double t_s, const PathPose& pose, const Vector& off_w) {
    WayPoint& point = script.waypoints.emplace_back();
    point.phase = phase;
    point.t_s = t_s;
    for (int k = 0; k < 3; ++k) point.p[k] = pose.p[k] + off_w[k];
    const double q[4] = {pose.q.w(), pose.q.x(), pose.q.y(), pose.q.z()};
    std::copy_n(q, 4, point.q_wxyz);
  };
  const PathPose first = contact.path.pose(0);
  add("off", 0.0, first, contact.path.retreat_w);
  add("press", 0.2, first, Vector::Zero());
  for (int k = 1; k <= 4; ++k)
    add("along", 0.2 + 0.1 * k, contact.path.pose(0.25 * k * contact.path.duration_s),
        Vector::Zero());
  return script;
}

}  // namespace

TEST_SUITE("host_sim.loop_rates") {
  TEST_CASE("on both paths the loop ticks in contact, and the work of its ticks can be repeated") {
    for (const ReportPath path : {ReportPath::kUsb, ReportPath::kInProcess}) {
      INFO(to_text(path));
      const auto r = rate_with(RateFault::kNone, path);
      CHECK(r->ticks > 0);
      CHECK(r->judged > 0);
      CHECK(r->contact_ticks > 0);
      CHECK(r->answer.count() > 0);
      CHECK(r->reports_per_s > 0);
      CHECK(r->unmatched == 0u);  // same inputs, same commands
      CHECK(r->work.count() == r->judged);
      std::uint64_t sum = 0;
      for (const std::uint64_t count : r->causes) sum += count;
      CHECK(sum == r->judged);
      CHECK(r->late_by(hal::LateCause::kTick) == 0u);
    }
  }

  TEST_CASE("too much work is the tick's cause, also for the tick after it") {
    const auto r = rate_with(RateFault::kTick, ReportPath::kInProcess);
    CHECK(r->late_by(hal::LateCause::kTick) >= 2 * kInjectedFaults - 2);
    CHECK(r->unmatched == 0u);
  }

  // A signal may find a thread that the machine has held up already, or within a tick.
  TEST_CASE("a thread that is held up in its sleep is woken late") {
    const auto r = rate_with(RateFault::kWakeUp, ReportPath::kInProcess);
    CHECK(r->late_by(hal::LateCause::kWakeUp) + r->late_by(hal::LateCause::kHeldUp) >=
          kInjectedFaults - 2);
    CHECK(r->late_by(hal::LateCause::kWakeUp) >= kInjectedFaults / 2);
    CHECK(r->late_by(hal::LateCause::kTick) == 0u);
  }

  TEST_CASE("reports that are lost are the device's or the bus's") {
    const auto r = rate_with(RateFault::kReport, ReportPath::kUsb);
    CHECK(r->late_by(hal::LateCause::kReport) >= 2 * kInjectedFaults);
    CHECK(r->late_by(hal::LateCause::kTick) == 0u);
  }

  TEST_CASE(
      "error of passes, at each rate: one pass has more than the scene's own; no law but proxy has "
      "any") {
    const ContactCase peg = insertion_case(1e-4);
    CoreSession session(compiled(peg.scene, LawId::kProxy), "peg");
    const MotionScript motion = motion_of(peg);
    const double rates_hz[] = {1000, 10'000};
    const std::vector<RateError> errors = rate_errors(session.view(), motion, rates_hz);
    REQUIRE(errors.size() == 4u);
    for (std::size_t k = 0; k < errors.size(); ++k) {
      INFO(errors[k].passes, " passes, median ", errors[k].median_force_error_n, ", p99 ",
           errors[k].p99_force_error_n, ", max ", errors[k].max_force_error_n, " of ",
           errors[k].largest_force_n, " contact ", errors[k].contact_ticks, " of ",
           errors[k].ticks);
      CHECK(errors[k].rate_hz == rates_hz[k / 2]);
      CHECK(errors[k].contact_ticks > 0u);
      CHECK(errors[k].largest_force_n > 0.1);
      CHECK(errors[k].median_force_error_n <= errors[k].p99_force_error_n);
      CHECK(errors[k].p99_force_error_n <= errors[k].max_force_error_n);
      CHECK(errors[k].p99_force_error_n < errors[k].largest_force_n);
    }
    CHECK(errors[0].passes == session.view().parameters().coupling.passes);
    CHECK(errors[1].passes == 1u);
    CHECK(errors[2].ticks == 10 * (errors[0].ticks - 1) + 1);
    CHECK(errors[1].p99_force_error_n > errors[0].p99_force_error_n);
    CHECK(errors[3].p99_force_error_n > errors[2].p99_force_error_n);
    CHECK(errors[3].p99_force_error_n < errors[1].p99_force_error_n);  // shorter steps
    const std::vector<std::byte> other = scene_with_law(session.view(), LawId::kPaper);
    CoreSession paper(other, "paper");
    CHECK_THROWS_AS(static_cast<void>(rate_errors(paper.view(), motion, rates_hz)),
                    tools::InputError);
  }
}

}  // namespace haptic::sim
