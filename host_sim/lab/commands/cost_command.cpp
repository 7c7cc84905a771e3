// SPDX-License-Identifier: Apache-2.0
// host_sim cost --out DIR [--quick] [--scenes peg,field,..] [--compare DIR2] [--no-instructions]
//               [--repeats 5]
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "host_sim/lab/commands/lab_commands.hpp"
#include "host_sim/lab/cost/cost_work.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"

namespace haptic::sim {
namespace {

struct CostArguments {
  CostPlan plan;
  std::vector<std::string> scenes;
  bool no_instructions = false, no_measure = false;
};

std::vector<CostScene> chosen_scenes(const CostArguments& o) {
  std::vector<CostScene> scenes;
  for (const std::string& name : o.scenes) scenes.push_back(cost_scene(name));
  if (!scenes.empty()) return scenes;
  for (const CostSceneName& each : cost_scene_names()) {
    if (each.by_default) scenes.push_back(cost_scene(each.name));
  }
  return scenes;
}

int do_cost(CostArguments o) {
  const std::vector<CostScene> scenes = chosen_scenes(o);
  tools::claim_folder(o.plan.folder, "--out", {});
  o.plan.instructions = !o.no_instructions;
  for (const CostScene& scene : scenes) {
    std::fprintf(stderr, "cost: %s, %s\n", scene.name.c_str(), scene.words.c_str());
    const PreparedScene prepared = prepare_cost_scene(scene, o.plan);
    const CostRun run = measure_cost(prepared, o.plan);
    std::printf("%s: %u pairs, %zu ticks, %s\n", run.name.c_str(), run.pairs, run.ticks.size(),
                run.instructions.why_not.c_str());
    std::fputs(instruction_table(run.instructions).c_str(), stdout);
    double most = 0, sum = 0;
    std::size_t contact = 0;
    for (const CostTick& tick : run.ticks) {
      most = std::max(most, tick.time_ns);
      sum += tick.time_ns;
      contact += tick.situation != ContactSituation::kNone;
    }
    std::printf("  %zu in contact, mean %.1f us, largest %.1f us, %llu state, %llu blob\n", contact,
                sum / 1e3 / static_cast<double>(run.ticks.size()), most / 1e3,
                static_cast<unsigned long long>(run.state_bytes),
                static_cast<unsigned long long>(run.blob_bytes));
  }
  return tools::kExitDone;
}

}  // namespace

Command add_cost_command(CLI::App& program) {
  const auto o = std::make_shared<CostArguments>();
  CLI::App* app = program.add_subcommand(
      "cost", "Counts the work of a tick on seven scenes; compares with an earlier build.");
  app->add_option("-o,--out", o->plan.folder, "folder for tables, scenes and motions")->required();
  app->add_flag("--quick", o->plan.quick, "motions four times as fast, for tests");
  app->add_option("--scenes", o->scenes, "names, separated by commas (default: all but pieces1000)")
      ->delimiter(',');
  app->add_option("--repeats", o->plan.repeats, "runs per tick for the times (default 5)")
      ->check(CLI::Range(1, 10000));
  app->add_flag("--no-instructions", o->no_instructions,
                "leave out the count of instructions under valgrind");
  return {app, [o] { return do_cost(*o); }, "host_sim cost --quick --out cost"};
}

}  // namespace haptic::sim
