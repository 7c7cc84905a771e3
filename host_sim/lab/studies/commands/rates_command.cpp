// SPDX-License-Identifier: Apache-2.0
// host_sim rates --scene S.rtscene [--seconds 5] [--rates 1000,2000,4000,8000,10000] [--out DIR]
// [--error [--script MOTION]] [--fault wake-up|tick|report]
#include <array>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "host_sim/device/pressing_script.hpp"
#include "host_sim/lab/studies/commands/study_commands.hpp"
#include "host_sim/lab/studies/realtime/loop_rates.hpp"
#include "host_sim/lab/studies/realtime/rate_error.hpp"
#include "host_sim/report/part_report.hpp"
#include "host_sim/session/core_session.hpp"
#include "host_sim/session/moving_parts.hpp"
#include "tools/common/command_line.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"

namespace haptic::sim {
namespace {

using Results = std::vector<std::unique_ptr<RateResult>>;
using Json = nlohmann::ordered_json;

struct RatesArguments {
  std::string scene, out, script;
  RateQuestion question;
  bool error = false;
};

constexpr double kErrorMotion_s = 2.0;
constexpr std::array<hal::LateCause, 5> kShownCauses = {
    hal::LateCause::kWakeUp, hal::LateCause::kHeldUp, hal::LateCause::kTick,
    hal::LateCause::kReport, hal::LateCause::kTogether};

double microseconds(std::int64_t ns) { return 1e-3 * static_cast<double>(ns); }
unsigned long long whole(std::uint64_t count) { return count; }

Json json_of(const hal::WakeupHistogram& h) {
  return {{"count", h.count()},
          {"p50_us", microseconds(h.quantile_ns(0.5))},
          {"p99_us", microseconds(h.quantile_ns(0.99))},
          {"p99.9_us", microseconds(h.quantile_ns(0.999))},
          {"max_us", microseconds(h.largest_ns())}};
}

Json json_of(const RateResult& r) {
  Json rate;
  rate["rate_hz"] = r.rate_hz;
  rate["path"] = to_text(r.path);
  rate["ticks"] = r.ticks;
  rate["late"] = {{"below_a_period", r.in_time}, {"held", r.held}, {"beyond", r.beyond}};
  rate["late_allowed"] = r.late_allowed;
  for (std::size_t k = 0; k < hal::kLateCauses; ++k)
    rate["late_by_cause"][hal::to_text(static_cast<hal::LateCause>(k))] = r.causes[k];
  rate["judged_ticks"] = r.judged;
  rate["work_not_repeated"] = r.unmatched;
  rate["contact_ticks"] = r.contact_ticks;
  rate["asked_reports_per_s"] = r.asked_reports_hz;
  rate["reports_per_s"] = r.reports_per_s;
  rate["ticks_without_new_state"] = r.without_state;
  rate["safety_faults"] = r.safety_faults;
  rate["tick"] = json_of(r.tick);
  rate["tick_work_alone"] = json_of(r.work);
  rate["tick_over_work_alone"] = r.cold;
  rate["wake_up"] = json_of(r.lateness);
  rate["report_to_command"] = json_of(r.answer);
  rate["machine_alone"] = json_of(r.machine.lateness);
  rate["machine_alone"]["late"] = r.machine.late_ticks;
  rate["fifo"] = {{"loop", r.grants.fifo()}, {"machine_alone", r.machine.priority > 0}};
  rate["ticks_fit"] = r.ticks_fit;
  rate["late_as_machine"] = r.late_as_machine;
  rate["holds"] = r.holds();
  return rate;
}

Json json_of(const RateError& e) {
  return {{"rate_hz", e.rate_hz},
          {"passes", e.passes},
          {"ticks", e.ticks},
          {"contact_ticks", e.contact_ticks},
          {"median_force_error_n", e.median_force_error_n},
          {"p99_force_error_n", e.p99_force_error_n},
          {"max_force_error_n", e.max_force_error_n},
          {"p99_torque_error_nm", e.p99_torque_error_nm},
          {"max_torque_error_nm", e.max_torque_error_nm},
          {"largest_force_n", e.largest_force_n},
          {"largest_torque_nm", e.largest_torque_nm},
          {"p99_tick_us", 1e-3 * e.p99_tick_ns}};
}

std::string account(const RatesArguments& o, const Results& results,
                    const std::vector<RateError>& errors) {
  Json json;
  json["scene"] = o.scene;
  json["seconds"] = o.question.seconds;
  json["clock"] = "timer; reports of the simulated device at the same rate, on USB 8000 Hz at most";
  for (const auto& r : results)
    json[r->path == ReportPath::kUsb ? "rates" : "in_process"].push_back(json_of(*r));
  json["highest_rate_hz"] = highest_rate(results);
  for (const RateError& e : errors) json["error_against_20_passes"].push_back(json_of(e));
  return json.dump(2) + "\n";
}

const char* shown(ReportPath path) { return path == ReportPath::kUsb ? "usb" : "in process"; }

void print_rate(const RateResult& r) {
  std::printf(
      "%7.0f  %-10s  %8llu %7llu %7llu  %7.0f  %6.1f %7.1f %8.1f  %7.1f %8.1f  %7.1f %8.1f %6llu  "
      "%s\n",
      r.rate_hz, shown(r.path), whole(r.ticks), whole(r.held), whole(r.beyond), r.reports_per_s,
      microseconds(r.tick.quantile_ns(0.5)), microseconds(r.tick.quantile_ns(0.999)),
      microseconds(r.tick.largest_ns()), microseconds(r.lateness.quantile_ns(0.999)),
      microseconds(r.lateness.largest_ns()), microseconds(r.machine.lateness.quantile_ns(0.999)),
      microseconds(r.machine.lateness.largest_ns()), whole(r.machine.late_ticks),
      r.holds()     ? "holds"
      : r.ticks_fit ? "LATER THAN THE MACHINE"
                    : "NO ROOM");
  std::fflush(stdout);
}

void print_tail(const RateResult& r, const char* what, const hal::WakeupHistogram& h) {
  std::printf("%7.0f  %-10s  %-18s %8.1f %8.1f %8.1f %9.1f\n", r.rate_hz, shown(r.path), what,
              microseconds(h.quantile_ns(0.5)), microseconds(h.quantile_ns(0.99)),
              microseconds(h.quantile_ns(0.999)), microseconds(h.largest_ns()));
}

void print_tails(const Results& results) {
  std::printf("\n%7s  %-10s  %-18s %8s %8s %8s %9s   (us)\n", "rate", "path", "", "p50", "p99",
              "p99.9", "largest");
  for (const auto& r : results) {
    if (r->path == ReportPath::kUsb) print_tail(*r, "machine alone", r->machine.lateness);
    print_tail(*r, "wake-up", r->lateness);
    print_tail(*r, "tick", r->tick);
    print_tail(*r, "its work alone", r->work);
    print_tail(*r, "report to command", r->answer);
  }
}

void print_causes(const Results& results) {
  std::printf("\n%7s  %-10s  %8s %7s  %8s %8s  %7s %7s  %8s\n", "rate", "path", "ticks", "late",
              "wake-up", "held up", "tick", "report", "together");
  for (const auto& r : results) {
    std::printf("%7.0f  %-10s  %8llu %7llu", r->rate_hz, shown(r->path), whole(r->judged),
                whole(r->judged - r->late_by(hal::LateCause::kInTime)));
    for (std::size_t k = 0; k < kShownCauses.size(); ++k)
      std::printf("%s%*llu", k % 2 == 0 ? "  " : " ", k < 2 || k == 4 ? 8 : 7,
                  whole(r->late_by(kShownCauses[k])));
    std::printf("\n");
  }
  std::printf(
      "(late: the command is published after the end of its period, or rests on a report that is "
      "late. wake-up, held up:\n the machine, before and within the tick. tick: its own work does "
      "not fit into the period. report: device or\n bus. together: work that fits, and a delay "
      "that is too long for what it leaves)\n");
}

void print_errors(const std::vector<RateError>& errors) {
  std::printf(
      "\nerror against 20 passes in quarter steps, in contact; largest force %.3g N, torque %.3g N "
      "m\n%7s %7s %8s  %12s %12s  %14s %14s  %8s\n",
      errors.front().largest_force_n, errors.front().largest_torque_nm, "rate", "passes", "ticks",
      "p99 force, N", "largest", "p99 torque, Nm", "largest", "tick, us");
  for (const RateError& e : errors)
    std::printf("%7.0f %7u %8llu  %12.3g %12.3g  %14.3g %14.3g  %8.1f\n", e.rate_hz, e.passes,
                whole(e.contact_ticks), e.p99_force_error_n, e.max_force_error_n,
                e.p99_torque_error_nm, e.max_torque_error_nm, 1e-3 * e.p99_tick_ns);
}

std::vector<RateError> errors_of(const RatesArguments& o, CoreSession& session) {
  const MotionScript motion =
      o.script.empty()
          ? pressing_script(session, session.view().parameters().rate_hz, kErrorMotion_s)
          : read_motion_script(o.script);
  std::vector<RateError> errors = rate_errors(session.view(), motion, o.question.rates_hz);
  for (const RateError& e : errors) {
    if (e.contact_ticks == 0)
      throw tools::InputError(o.scene +
                              ": the motion touches nothing; give one that does with "
                              "--script");
  }
  return errors;
}

void print_heading() {
  std::printf(
      "servo loop by timer, thread of the link, simulated device with reports at the same rate "
      "(on USB %.0f Hz at most);\nusb: on the bus in this process; microseconds\n",
      kMostUsbReports_hz);
  std::printf("%7s  %-10s  %8s %7s %7s  %7s  %6s %7s %8s  %7s %8s  %7s %8s %6s\n", "rate", "path",
              "ticks", "held", "beyond", "reports", "tick", "p99.9", "max", "wake-up", "max",
              "machine", "max", "late");
}

int do_rates(const RatesArguments& o) {
  tools::claim_folder(o.out, "--out", {"rates.json"});
  CoreSession session(o.scene);
  require_one_moving_part(session, o.scene, "rates",
                          "run it with 'host_sim run', or give a scene of one moving part");
  // First what can be refused.
  const std::vector<RateError> errors = o.error ? errors_of(o, session) : std::vector<RateError>();
  print_heading();
  Results results;
  for (const double rate_hz : o.question.rates_hz) {
    const auto machine = machine_alone(rate_hz, o.question.seconds);
    for (const ReportPath path : {ReportPath::kUsb, ReportPath::kInProcess}) {
      if (o.question.fault == RateFault::kReport && path != ReportPath::kUsb) continue;
      results.push_back(measure_rate(session, rate_hz, path, o.question, *machine));
      print_rate(*results.back());
    }
  }
  const RateResult& last = *results.back();
  std::printf("SCHED_FIFO %s; memory lock %s\n", last.grants.fifo() ? "granted" : "refused",
              last.grants.memory_lock == 0 ? "granted" : "refused");
  std::printf("highest rate that holds: %.0f Hz\n", highest_rate(results));
  std::printf(
      "(holds: p99.9 of the tick and p99.9 of the machine's own wake-ups together are below "
      "the period, and ticks\n a period late or more are not more than the machine's own "
      "wake-ups, by three standard deviations and three ticks)\n");
  print_tails(results);
  print_causes(results);
  if (!errors.empty()) print_errors(errors);
  if (!o.out.empty()) write_whole_file(o.out + "/rates.json", account(o, results, errors));
  return highest_rate(results) > 0 ? tools::kExitDone : tools::kExitCheckFailed;
}

}  // namespace

Command add_rates_command(CLI::App& program) {
  const auto o = std::make_shared<RatesArguments>();
  CLI::App* app = program.add_subcommand(
      "rates",
      "Finds the highest rate of the servo loop that holds on this machine, and why ticks are "
      "late.");
  app->add_option("scene,--scene", o->scene, "compiled scene (.rtscene)")->required();
  app->add_option("--seconds", o->question.seconds,
                  "of each rate on each path, and as long of the machine alone; default 5")
      ->check(tools::number_within(1.0, 3600.0));
  app->add_option("--rates", o->question.rates_hz,
                  "Hz, ascending; default 1000,2000,4000,8000,10000")
      ->delimiter(',')
      ->check(tools::number_within(100.0, 10000.0));
  app->add_option("-o,--out", o->out, "folder for rates.json");
  auto* error = app->add_flag("--error", o->error,
                              "also the error of force and torque of the scene's passes at each "
                              "rate, against 20 passes");
  app->add_option("--script", o->script,
                  "motion script (TOML) of the part for --error; default: it presses on the "
                  "nearest fixed part, and slides")
      ->needs(error);
  tools::add_choice<RateFault>(
      *app, "--fault", o->question.fault,
      {{"wake-up", RateFault::kWakeUp}, {"tick", RateFault::kTick}, {"report", RateFault::kReport}},
      "self-test: ten late wake-ups, ten ticks with too much work, or ten "
      "gaps in the reports; each is found under its cause");
  return {app, [o] { return do_rates(*o); }, "host_sim rates --scene peg.rtscene"};
}

}  // namespace haptic::sim
