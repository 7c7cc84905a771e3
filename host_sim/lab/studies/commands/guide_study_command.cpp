// SPDX-License-Identifier: Apache-2.0
// host_lab guide-study --out DIR [--runs N] [--plans N] [--seed N] [--quick] [--threads N]
#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>

#include "host_sim/lab/studies/commands/study_commands.hpp"
#include "host_sim/lab/studies/planning/guide_study.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"

namespace haptic::sim {
namespace {

struct GuideStudyArguments {
  std::string out;
  bool quick = false;
  GuideStudyOptions options;
};

int do_guide_study(GuideStudyArguments o) {
  tools::claim_folder(o.out, "--out", {});
  if (o.quick) {
    o.options.runs = 6;
    o.options.plans = 1;
  }
  const GuideStudyBench bench = guide_study_bench(o.options);
  const std::vector<StudyCell> cells = run_guide_study(bench, o.options);
  for (const OutputText& file : guide_study_files(bench, cells, o.options))
    write_whole_file(o.out + "/" + file.name, file.content);
  const bool passed = verdict_of(cells).passed();
  std::printf("%s/guide_study.md: %s\n", o.out.c_str(), passed ? "passed" : "FAILED");
  return passed ? tools::kExitDone : tools::kExitCheckFailed;
}

}  // namespace

Command add_guide_study_command(CLI::App& program) {
  const auto o = std::make_shared<GuideStudyArguments>();
  o->options.threads = std::max(1u, std::thread::hardware_concurrency());
  CLI::App* app = program.add_subcommand(
      "guide-study",
      "Lets simulated hands put a peg into its hole: contact alone, a guide, wrong guides.");
  app->add_option("-o,--out", o->out, "folder for the tables, the page and the picture")
      ->required();
  app->add_option("--runs", o->options.runs, "of each hand with each guide (default 1000)")
      ->check(CLI::Range(1, 1000000));
  app->add_option("--plans", o->options.plans, "seeds of the planner (default 4)")
      ->check(CLI::Range(1, 64));
  app->add_option("--seed", o->options.seed, "of the hands (default 1)");
  app->add_option("--clearance-mm", o->options.clearance_mm, "of the peg per side (default 0.3)")
      ->check(tools::positive_number());
  app->add_flag("--quick", o->quick, "6 runs and one plan, for tests");
  app->add_option("--threads", o->options.threads, "default: one per processor")
      ->check(CLI::Range(1u, 256u));
  app->add_flag("--progress", o->options.progress, "a line every few seconds on standard error");
  return {app, [o] { return do_guide_study(*o); }, "host_sim guide-study --quick --out study"};
}

}  // namespace haptic::sim
