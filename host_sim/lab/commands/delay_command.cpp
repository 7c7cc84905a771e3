// SPDX-License-Identifier: Apache-2.0
// host_sim delay --scene S.rtscene [--rate HZ] [--seconds 5] [--phases 20] [--out DIR]
#include <cstdio>
#include <memory>
#include <string>

#include "host_sim/lab/commands/lab_commands.hpp"
#include "host_sim/lab/realtime/delay_report.hpp"
#include "host_sim/report/part_report.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"

namespace haptic::sim {
namespace {

struct DelayArguments {
  std::string scene, out;
  DelayQuestion question;
};

double us(std::int64_t ns) { return 1e-3 * static_cast<double>(ns); }

void print_mode(const DelayOfMode& mode) {
  std::printf("%s: %zu phases in virtual time; %zu of %llu reports in real time, SCHED_FIFO %s\n",
              name_of(mode), mode.exact.size(), mode.measured.at_ns.size(),
              static_cast<unsigned long long>(mode.measured.reports),
              mode.measured.grants.fifo() ? "granted" : "refused");
  std::printf(
      "  us after the sample        exact min   median      max    real median      p99"
      "      max\n");
  for (std::size_t k = 0; k < kDelayStages; ++k) {
    const auto stage = static_cast<DelayStage>(k);
    const DelayFigures e = exact_figures(mode, stage), r = measured_figures(mode, stage);
    std::printf("  %-24s %11.1f %8.1f %8.1f  %13.1f %8.1f %8.1f\n", to_text(stage), us(e.least_ns),
                us(e.median_ns), us(e.largest_ns), us(r.median_ns), us(r.p99_ns), us(r.largest_ns));
  }
}

int do_delay(const DelayArguments& o) {
  tools::claim_folder(o.out, "--out", {"delay.csv", "delay.json", "delay.svg"});
  std::vector<DelayOfMode> modes;
  for (const bool report_clocked : {false, true}) {
    DelayOfMode& mode = modes.emplace_back();
    mode.report_clocked = report_clocked;
    mode.exact = virtual_delays(o.scene, o.question, report_clocked);
    mode.measured = measured_delays(o.scene, o.question, report_clocked);
    print_mode(mode);
  }
  if (!o.out.empty()) {
    for (const OutputText& file : delay_files(o.scene, o.question, modes))
      write_whole_file(o.out + "/" + file.name, file.content);
  }
  for (const DelayOfMode& mode : modes) {
    if (mode.measured.at_ns.empty()) {
      std::fprintf(stderr, "host_sim: no report was answered in real time\n");
      return tools::kExitCheckFailed;
    }
  }
  return tools::kExitDone;
}

}  // namespace

Command add_delay_command(CLI::App& program) {
  const auto o = std::make_shared<DelayArguments>();
  CLI::App* app = program.add_subcommand(
      "delay", "Measures the time from a motion to the force that answers it, in both modes.");
  app->add_option("scene,--scene", o->scene, "compiled scene (.rtscene)")->required();
  app->add_option("--rate", o->question.rate_hz, "of reports and servo loop [Hz]; default 1000")
      ->check(CLI::Range(100.0, 8000.0));
  app->add_option("--seconds", o->question.seconds, "in real time, of each mode; default 5")
      ->check(CLI::Range(1.0, 600.0));
  app->add_option("--phases", o->question.phases,
                  "of the timer after the report, in virtual time; default 20")
      ->check(CLI::Range(1u, 1000u));
  app->add_option("-o,--out", o->out, "folder for delay.csv, delay.json and delay.svg");
  return {app, [o] { return do_delay(*o); }, "host_sim delay --scene peg.rtscene --out delay"};
}

}  // namespace haptic::sim
