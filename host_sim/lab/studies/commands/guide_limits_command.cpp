// SPDX-License-Identifier: Apache-2.0
// host_lab guide-limits --out DIR [--ticks N] [--seed N] [--quick] [--resume] [--fault energy]
// [--threads N]
#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>

#include "host_sim/lab/studies/commands/study_commands.hpp"
#include "host_sim/lab/studies/planning/guide_limits.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"

namespace haptic::sim {
namespace {

struct GuideLimitsArguments {
  std::string out;
  GuideLimitsOptions options;
};

int do_guide_limits(const GuideLimitsArguments& o) {
  tools::claim_folder(o.out, "--out", {});
  GuideLimitsOptions options = o.options;
  options.rows = o.out + "/guide_limits_rows.txt";
  const GuideLimits limits = run_guide_limits(options);
  for (const OutputText& file : guide_limits_files(limits, o.options))
    write_whole_file(o.out + "/" + file.name, file.content);
  std::printf("%s/guide_limits.md: %s\n", o.out.c_str(), limits.passed() ? "passed" : "FAILED");
  return limits.passed() ? tools::kExitDone : tools::kExitCheckFailed;
}

}  // namespace

Command add_guide_limits_command(CLI::App& program) {
  const auto o = std::make_shared<GuideLimitsArguments>();
  o->options.threads = std::max(1u, std::thread::hardware_concurrency());
  CLI::App* app = program.add_subcommand(
      "guide-limits", "Measures the loop with a guide on and off, and the most that a guide does.");
  app->add_option("-o,--out", o->out, "folder for the table and the page")->required();
  app->add_option("--ticks", o->options.ticks, "of the hostile hand (default 1000000)")
      ->check(CLI::Range(1000, 1000000000));
  app->add_option("--seed", o->options.seed, "of the hostile hand (default 11)");
  app->add_flag("--quick", o->options.quick, "fewer cells and shorter rests");
  tools::add_choice<GuideFault>(
      *app, "--fault", o->options.fault,
      {{"none", GuideFault::kNone}, {"energy", GuideFault::kEnergy}, {"stiff", GuideFault::kStiff}},
      "self-test: states a hundredth of the energy, or pulls forty times as strongly; must fail");
  app->add_option("--threads", o->options.threads, "default: one per processor")
      ->check(CLI::Range(1u, 256u));
  app->add_flag("--resume", o->options.resume,
                "goes on with the rows that a run with the same options left in the folder");
  app->add_flag("--progress", o->options.progress, "a line every few seconds on standard error");
  return {app, [o] { return do_guide_limits(*o); },
          "host_sim guide-limits --quick --out guide_limits"};
}

}  // namespace haptic::sim
