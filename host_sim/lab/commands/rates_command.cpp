// SPDX-License-Identifier: Apache-2.0
// host_sim rates --scene S.rtscene [--seconds 5] [--rates 1000,2000,4000,8000] [--out DIR]
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "host_sim/lab/commands/lab_commands.hpp"
#include "host_sim/lab/realtime/loop_rates.hpp"
#include "host_sim/report/part_report.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"

namespace haptic::sim {
namespace {

using Results = std::vector<std::unique_ptr<RateResult>>;
using Json = nlohmann::ordered_json;

struct RatesArguments {
  std::string scene, out;
  RateQuestion question;
};

double microseconds(std::int64_t ns) { return 1e-3 * static_cast<double>(ns); }
unsigned long long whole(std::uint64_t count) { return count; }

Json json_of(const hal::WakeupHistogram& h) {
  return {{"count", h.count()},
          {"p50_us", microseconds(h.quantile_ns(0.5))},
          {"p99_us", microseconds(h.quantile_ns(0.99))},
          {"p99.9_us", microseconds(h.quantile_ns(0.999))},
          {"max_us", microseconds(h.largest_ns())}};
}

std::string account(const RatesArguments& o, const Results& results) {
  Json json;
  json["scene"] = o.scene;
  json["seconds"] = o.question.seconds;
  json["clock"] = "timer; reports of the simulated device at the same rate";
  for (const auto& r : results) {
    Json rate;
    rate["rate_hz"] = r->rate_hz;
    rate["ticks"] = r->ticks;
    rate["late"] = {{"below_a_period", r->in_time}, {"held", r->held}, {"beyond", r->beyond}};
    rate["late_allowed"] = r->late_allowed;
    rate["contact_ticks"] = r->contact_ticks;
    rate["reports_per_s"] = r->reports_per_s;
    rate["ticks_without_new_state"] = r->without_state;
    rate["safety_faults"] = r->safety_faults;
    rate["tick"] = json_of(r->tick);
    rate["wake_up"] = json_of(r->lateness);
    rate["machine_alone"] = json_of(r->machine.lateness);
    rate["machine_alone"]["late"] = r->machine.late_ticks;
    rate["fifo"] = {{"loop", r->grants.fifo()}, {"machine_alone", r->machine.priority > 0}};
    rate["ticks_fit"] = r->ticks_fit;
    rate["late_as_machine"] = r->late_as_machine;
    rate["holds"] = r->holds();
    json["rates"].push_back(rate);
  }
  json["highest_rate_hz"] = highest_rate(results);
  return json.dump(2) + "\n";
}

void print_rate(const RateResult& r) {
  std::printf(
      "%7.0f  %8llu %7llu %7llu  %7.0f  %6.1f %7.1f %8.1f  %7.1f %8.1f  %7.1f %8.1f %6llu  %s\n",
      r.rate_hz, whole(r.ticks), whole(r.held), whole(r.beyond), r.reports_per_s,
      microseconds(r.tick.quantile_ns(0.5)), microseconds(r.tick.quantile_ns(0.999)),
      microseconds(r.tick.largest_ns()), microseconds(r.lateness.quantile_ns(0.999)),
      microseconds(r.lateness.largest_ns()), microseconds(r.machine.lateness.quantile_ns(0.999)),
      microseconds(r.machine.lateness.largest_ns()), whole(r.machine.late_ticks),
      r.holds()     ? "holds"
      : r.ticks_fit ? "LATER THAN THE MACHINE"
                    : "NO ROOM");
  std::fflush(stdout);
}

int do_rates(const RatesArguments& o) {
  tools::claim_folder(o.out, "--out", {"rates.json"});
  std::printf(
      "servo loop by timer, USB thread, simulated device on the bus in this process with "
      "reports at the same rate; microseconds\n");
  std::printf("%7s  %8s %7s %7s  %7s  %6s %7s %8s  %7s %8s  %7s %8s %6s\n", "rate", "ticks", "held",
              "beyond", "reports", "tick", "p99.9", "max", "wake-up", "max", "machine", "max",
              "late");
  Results results;
  for (const double rate_hz : o.question.rates_hz) {
    results.push_back(measure_rate(o.scene, rate_hz, o.question.seconds));
    print_rate(*results.back());
  }
  const RateResult& last = *results.back();
  std::printf("SCHED_FIFO %s; memory lock %s\n", last.grants.fifo() ? "granted" : "refused",
              last.grants.memory_lock == 0 ? "granted" : "refused");
  std::printf("highest rate that holds: %.0f Hz\n", highest_rate(results));
  std::printf(
      "(holds: p99.9 of the tick and p99.9 of the machine's own wake-ups together are below "
      "the period, and ticks\n a period late or more are not more than the machine's own "
      "wake-ups, by three standard deviations and three ticks)\n");
  if (!o.out.empty()) write_whole_file(o.out + "/rates.json", account(o, results));
  return highest_rate(results) > 0 ? tools::kExitDone : tools::kExitCheckFailed;
}

}  // namespace

Command add_rates_command(CLI::App& program) {
  const auto o = std::make_shared<RatesArguments>();
  CLI::App* app = program.add_subcommand(
      "rates", "Finds the highest rate of the servo loop that holds on this machine.");
  app->add_option("scene,--scene", o->scene, "compiled scene (.rtscene)")->required();
  app->add_option("--seconds", o->question.seconds,
                  "of each rate, and as long of the machine alone; default 5")
      ->check(CLI::Range(1.0, 3600.0));
  app->add_option("--rates", o->question.rates_hz, "Hz, ascending; default 1000,2000,4000,8000")
      ->delimiter(',')
      ->check(CLI::Range(100.0, 10000.0));
  app->add_option("-o,--out", o->out, "folder for rates.json");
  return {app, [o] { return do_rates(*o); }, "host_sim rates --scene peg.rtscene"};
}

}  // namespace haptic::sim
