// SPDX-License-Identifier: Apache-2.0
// host_sim cost [SCENE --motion M] --out DIR [--quick] [--scenes peg,field,..] [--compare DIR2]
//               [--repeats 5] [--no-instructions]
#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "host_sim/lab/commands/lab_commands.hpp"
#include "host_sim/lab/cost/cost_report.hpp"
#include "host_sim/session/child_run.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"

namespace haptic::sim {
namespace {

struct CostArguments {
  CostPlan plan;
  std::vector<std::string> scenes;
  std::string compare, scene, motion;
  bool no_instructions = false;
};

/// The scenes that are named, each once; by default all but the largest. None beside a scene of the
/// user's.
std::vector<CostScene> chosen_scenes(const CostArguments& o) {
  if (!o.scene.empty()) return {};
  std::vector<std::string> names;
  for (const std::string& name : o.scenes) {
    if (std::ranges::find(names, name) == names.end()) names.push_back(name);
  }
  for (const CostSceneName& each : cost_scene_names()) {
    if (o.scenes.empty() && each.by_default) names.emplace_back(each.name);
  }
  std::vector<CostScene> scenes;
  for (const std::string& name : names) scenes.push_back(cost_scene(name));
  return scenes;
}

int do_cost(const CostArguments& o) {
  const std::vector<CostScene> scenes = chosen_scenes(o);
  std::vector<PreparedScene> given;
  if (!o.scene.empty()) given.push_back(prepared_by_user(o.scene, o.motion));
  std::vector<std::string> names;
  for (const CostScene& scene : scenes) names.push_back(scene.name);
  for (const PreparedScene& scene : given) names.push_back(scene.scene.name);
  // Read before anything is written: an output that would replace an input is refused.
  std::vector<std::optional<EarlierRun>> earlier(names.size());
  for (std::size_t k = 0; k < names.size() && !o.compare.empty(); ++k)
    earlier[k] = read_earlier_run(o.compare, names[k]);
  std::vector<std::string> outputs{"cost.csv", "cost.json", "cost.svg", "comparison.csv"};
  for (const std::string& name : names) outputs.push_back(name + ".csv");
  tools::claim_folder(o.plan.folder, "--out", outputs);
  CostPlan plan = o.plan;
  plan.instructions = !o.no_instructions;
  std::vector<CostRun> runs;
  std::vector<CostDifference> differences;
  const auto write = [&](const std::string& name, const std::string& content) {
    write_whole_file(plan.folder + "/" + name, content);
  };
  for (std::size_t k = 0; k < names.size(); ++k) {
    const CostScene& scene = given.empty() ? scenes[k] : given[k].scene;
    std::fprintf(stderr, "cost: scene %zu of %zu, %s (%s)\n", k + 1, names.size(),
                 scene.name.c_str(), scene.words.c_str());
    const PreparedScene prepared = given.empty() ? prepare_cost_scene(scene, plan) : given[k];
    runs.push_back(measure_cost(prepared, plan));
    write(names[k] + ".csv", cost_ticks_csv(runs.back()));
    if (!o.compare.empty()) {
      differences.push_back(
          difference_of(runs.back(), file_text(prepared.motion_path), earlier[k]));
    }
  }
  write("cost.csv", cost_csv(runs));
  write("cost.json", cost_json(runs, differences));
  write("cost.svg", cost_picture(runs));
  std::fputs(cost_table(runs).c_str(), stdout);
  if (!differences.empty()) {
    write("comparison.csv", comparison_csv(differences));
    std::fputs(comparison_table(differences).c_str(), stdout);
  }
  const bool held =
      std::ranges::all_of(runs, [](const CostRun& run) { return figures_of(run).passed(); });
  const bool compared = all_compared(differences);
  std::printf("%s/cost.csv: %s%s\n", plan.folder.c_str(),
              held ? "every count within its bound" : "A CHECK FAILED",
              compared ? "" : "; THE EARLIER REPORT IS NOT COMPLETE");
  return held && compared ? tools::kExitDone : tools::kExitCheckFailed;
}

}  // namespace

Command add_cost_command(CLI::App& program) {
  const auto o = std::make_shared<CostArguments>();
  CLI::App* app = program.add_subcommand(
      "cost",
      "Counts the work of a tick on seven scenes, or on one of your own; compares with an earlier "
      "build.");
  CLI::Option* scene = app->add_option("scene,--scene", o->scene,
                                       "compiled scene (.rtscene) to run instead of ours");
  CLI::Option* motion =
      app->add_option("--motion", o->motion, "its motion: t,x,y,z,qw,qx,qy,qz")->needs(scene);
  scene->needs(motion);
  app->add_option("-o,--out", o->plan.folder, "folder for the files below")->required();
  app->add_option("--scenes", o->scenes,
                  "separated by commas: peg, ell, field, peg32, peg64_r10, peg64_r5, assembly, "
                  "pieces1000, thread24, sphere100k\n(default: all but the last three)")
      ->delimiter(',')
      ->excludes(scene);
  app->add_option("--compare", o->compare, "folder of an earlier report of the same scenes")
      ->check(CLI::ExistingDirectory);
  app->add_flag("--quick", o->plan.quick, "motions four times as fast, for tests")->excludes(scene);
  app->add_option("--repeats", o->plan.repeats, "runs per tick for the times (default 5)")
      ->check(CLI::Range(1, 10000));
  app->add_flag("--no-instructions", o->no_instructions,
                "leave out the count of instructions under valgrind");
  app->footer(
      "Law proxy with the compiler's defaults, no device. graph_compiler must lie next to this\n"
      "program. About two minutes; pieces1000 takes 2 GB and wants --no-instructions.\n"
      "Files in --out:\n"
      "  cost.csv, cost.json  a row per scene: instructions, times, also with cold caches, "
      "memory,\n"
      "                       work and its bound\n"
      "  NAME.csv             a line per tick: instructions, counters, wrench, proxy, gap\n"
      "  cost.svg             distribution of the instructions over the ticks\n"
      "  comparison.csv       with --compare: how far the results are apart\n"
      "  NAME.rtscene, NAME_motion.csv, scenes/NAME/  for replay and for opening\n"
      "Exit codes: 0 done, 1 a count over its bound, a result that is no number, a tick that ends\n"
      "differently from the same state, or a scene, tick or motion that the earlier report lacks,\n"
      "2 usage, 3 bad input, 4 refused by the system.");
  return {app, [o] { return do_cost(*o); }, "host_sim cost --quick --out cost"};
}

}  // namespace haptic::sim
