// SPDX-License-Identifier: Apache-2.0
// host_sim planners --out DIR [--seconds S] [--seeds N] [--ours-only] [--until-failed]
// [--puzzles NAME | --scene FILE --goal POSE] [--resume] ...
#include <cstdio>
#include <memory>
#include <string>

#include "host_sim/lab/studies/commands/study_commands.hpp"
#include "host_sim/lab/studies/planning/planning_table.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"

namespace haptic::sim {
namespace {

struct PlannersArguments {
  std::string out;
  PlanningOptions options;
};

int do_planners(const PlannersArguments& o) {
  tools::claim_folder(o.out, "--out", {"planning.md", "planning.csv"});
  PlanningOptions options = o.options;
  options.rows = o.out + "/planning_rows.txt";
  if (options.scene.empty() != options.goal.empty() ||
      (!options.scene.empty() && !options.puzzles.empty()))
    throw tools::UsageError("--scene: give --goal with it, and no --puzzles");
  if (planning_puzzles(options).empty())
    throw tools::UsageError("--puzzles: no puzzle's name begins with '" + options.puzzles +
                            "'; peg, corner, window, slot, ring, twist and cage are puzzles");
  const auto write = [&](const std::vector<PlanningRow>& done) {
    for (const OutputText& file : planning_files(done, options))
      write_whole_file(o.out + "/" + file.name, file.content);
  };
  const std::vector<PlanningRow> rows = run_planning(options, write);
  const bool passed = planning_passed(rows);
  std::printf("%s/planning.md: %s\n", o.out.c_str(), passed ? "passed" : "FAILED");
  return passed ? tools::kExitDone : tools::kExitCheckFailed;
}

}  // namespace

Command add_planners_command(CLI::App& program) {
  const auto o = std::make_shared<PlannersArguments>();
  CLI::App* app = program.add_subcommand(
      "planners", "Compares the planner with those of OMPL, where it is built in, on puzzles.");
  app->add_option("-o,--out", o->out, "folder for the table, planning.md and planning.csv")
      ->required();
  app->add_option("--seconds", o->options.seconds, "of a processor, for one run (default 120)")
      ->check(tools::positive_number());
  app->add_option("--seeds", o->options.seeds, "runs of a planner on a puzzle (default 3)")
      ->check(CLI::Range(1, 1000));
  app->add_flag("--ours-only", o->options.ours_only, "without OMPL's");
  app->add_flag("--until-failed", o->options.until_failed,
                "do not run a planner of OMPL where it failed with a larger clearance");
  app->add_flag("--quick", o->options.quick, "three puzzles, for tests");
  app->add_option("--puzzles", o->options.puzzles,
                  "only those whose name begins so: ring, ring_0.1");
  app->add_option("--scene", o->options.scene,
                  "a compiled scene instead of puzzles, from its start");
  app->add_option("--goal", o->options.goal,
                  "with --scene: x,y,z[,qw,qx,qy,qz] of the moving part's file frame [m, or 5mm]");
  app->add_flag("--resume", o->options.resume,
                "goes on with the rows that a run with the same options left in the folder");
  app->add_flag("--progress", o->options.progress, "a line per planner on standard error");
  return {app, [o] { return do_planners(*o); }, "host_sim planners --quick --out planners"};
}

}  // namespace haptic::sim
