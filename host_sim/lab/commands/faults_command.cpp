// SPDX-License-Identifier: Apache-2.0
// host_sim faults --out DIR [--quick] [--processes [--bridged] [--process NAME]...
// [--stale-ms MS]] [--carrier usb|direct] [--report-clocked]
//                 [--hands 1|2] [--threads N]
#include <algorithm>
#include <cstdio>
#include <map>
#include <memory>
#include <string>
#include <thread>

#include "host_sim/lab/commands/lab_commands.hpp"
#include "host_sim/lab/faults/fault_matrix.hpp"
#include "host_sim/lab/processes/process_matrix.hpp"
#include "host_sim/report/part_report.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"

namespace haptic::sim {
namespace {

struct FaultsArguments {
  std::string out;
  FaultMatrixOptions matrix;
  bool processes = false, bridged = false;
  std::vector<std::string> of;  ///< processes whose rows are run; empty: all
  double stale_ms = 0;
};

int do_process_faults(const FaultsArguments& o) {
  tools::claim_folder(o.out, "--out", {"processes*"});
  ProcessMatrixOptions options;
  options.quick = o.matrix.quick;
  options.bridged = o.bridged;
  options.stale_ms = o.stale_ms;
  options.wanted = [&o](const ProcessCase& cell) {
    return o.of.empty() ||
           std::find(o.of.begin(), o.of.end(), to_text(cell.fault->victim)) != o.of.end();
  };
  options.told = [](const ProcessVerdict& v) {
    std::printf("%s, %s, %s: %s", to_text(v.cell.fault->victim), v.cell.fault->name,
                to_text(v.cell.state), v.failures.empty() ? "holds" : "FAILS");
    std::printf(v.tries > 1 ? " (%u tries)\n" : "\n", v.tries);
    for (const std::string& failure : v.failures) std::printf("  %s\n", failure.c_str());
    if (!v.failures.empty()) std::printf("%s\n", v.said.c_str());
    std::fflush(stdout);
  };
  const std::vector<ProcessVerdict> verdicts = run_process_matrix(options);
  for (const OutputText& file : process_files(verdicts))
    write_whole_file(o.out + "/" + file.name, file.content);
  const auto held = std::count_if(verdicts.begin(), verdicts.end(),
                                  [](const ProcessVerdict& v) { return v.failures.empty(); });
  std::printf("%s/processes.md: %td of %zu cells hold\n", o.out.c_str(), held, verdicts.size());
  return all_hold(verdicts) ? tools::kExitDone : tools::kExitCheckFailed;
}

int do_faults(const FaultsArguments& o) {
  if (o.processes) return do_process_faults(o);
  if (o.matrix.run.hands > 1 && o.matrix.run.report_clocked)
    throw tools::UsageError("--report-clocked: two devices are not; leave it out, or --hands");
  tools::claim_folder(o.out, "--out", {"faults*"});
  const std::vector<FaultVerdict> verdicts = run_fault_matrix(o.matrix);
  for (const OutputText& file : fault_files(verdicts, o.matrix))
    write_whole_file(o.out + "/" + file.name, file.content);
  std::size_t failed = 0;
  for (const FaultVerdict& v : verdicts) {
    if (!v.failures.empty()) ++failed;
    for (const std::string& failure : v.failures)
      std::printf("  %s%s, %s: %s\n", v.cell.fault->name, v.hand > 0 ? " (second hand)" : "",
                  to_text(v.cell.state), failure.c_str());
  }
  std::printf("%s/faults.md: %zu of %zu cells hold\n", o.out.c_str(), verdicts.size() - failed,
              verdicts.size());
  return failed == 0 ? tools::kExitDone : tools::kExitCheckFailed;
}

}  // namespace

Command add_faults_command(CLI::App& program) {
  const auto o = std::make_shared<FaultsArguments>();
  o->matrix.threads = std::max(1u, std::thread::hardware_concurrency());
  CLI::App* app = program.add_subcommand(
      "faults", "Makes every fault of device, bus and servo loop happen in every state.");
  app->add_option("-o,--out", o->out, "folder for faults.csv, faults.md and faults.svg")
      ->required();
  app->add_flag("--quick", o->matrix.quick, "only the states with force");
  app->add_flag(
      "--processes", o->processes,
      "in place of the device's faults: those of every process of run_device, in real time; "
      "processes.csv, processes.md, processes.svg");
  app->add_flag("--bridged", o->bridged,
                "with --processes: the device is behind a bridge in every case, not in those of "
                "the bridge alone")
      ->needs("--processes");
  app->add_option("--process", o->of,
                  "with --processes: only the rows of this process, by its name in the table; may "
                  "be given again")
      ->needs("--processes")
      ->check(CLI::Validator(
          [](const std::string& name) {
            for (int k = 0; k <= static_cast<int>(ProcessVictim::kBridge); ++k) {
              if (name == to_text(static_cast<ProcessVictim>(k))) return std::string();
            }
            return "no process '" + name + "' in the table of hal/README.md";
          },
          "NAME"));
  app->add_option("--stale-ms", o->stale_ms,
                  "self-test: with --processes, commands wait so long in a queue of the device's "
                  "process, so the check must fail")
      ->needs("--processes")
      ->check(CLI::Range(0.0, 1000.0));
  tools::add_choice<StackCarrier>(
      *app, "--carrier", o->matrix.run.carrier,
      {{"usb", StackCarrier::kUsb}, {"direct", StackCarrier::kDirect}},
      "usb (default): through libusb; direct: no bus, and none of its faults");
  app->add_flag("--report-clocked", o->matrix.run.report_clocked,
                "commands answer the report that they rest on");
  app->add_option(
         "--hands", o->matrix.run.hands,
         "1 (default), or 2: a device for each of two hands, each fault at one and then at "
         "the other")
      ->check(CLI::Range(1u, 2u));
  app->add_option("--threads", o->matrix.threads, "default: one per processor")
      ->check(CLI::Range(1u, 16u));
  return {app, [o] { return do_faults(*o); }, "host_sim faults --quick --out faults"};
}

}  // namespace haptic::sim
