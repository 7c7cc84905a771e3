// SPDX-License-Identifier: Apache-2.0
// host_sim surface-fuzz
#include <memory>

#include "host_sim/lab/commands/campaign_command.hpp"
#include "host_sim/lab/commands/lab_commands.hpp"
#include "host_sim/lab/surface_fuzz/surface_campaign.hpp"
#include "host_sim/lab/surface_fuzz/surface_comparison.hpp"
#include "tools/common/command_line.hpp"

namespace haptic::sim {

Command add_surface_fuzz_command(CLI::App& program) {
  CampaignWords words{
      "surface-fuzz",
      "Random devices against triangle meshes; every felt pose judged by triangles.",
      "host_sim surface-fuzz --out surfaces",
      "folder for surface_fuzz.md, .csv and .json, or surface_compare.*",
      {"surface_fuzz.*", "scene.toml", "part.obj", "around.obj", "motion.csv"},
      {"displaced", "goal", "restless", "certificate"},
      "the run of this number, as a failure names it; --out gets its scene and motion too",
      "falsify what is judged, or the core, on purpose: exit 1 when the fault is caught"};
  struct Asked : CampaignArguments {
    SurfaceFuzzSize size;
    bool compare = false;
  };
  const auto o = std::make_shared<Asked>();
  CLI::App* app = add_campaign(program, words, *o, o->size.seed);
  CLI::Option* scene = app->add_option("scene,--scene", o->size.scene_file,
                                       "scene file (.toml) to run instead of our own scenes");
  add_count(*app, "--ticks", o->size.ticks, std::uint64_t{1} << 40,
            "ticks over all scenes, rests on top (default 200000)");
  app->add_option("--motion", o->size.motion_file,
                  "its motion (t,x,y,z,qw,qx,qy,qz) instead of those drawn from the seed")
      ->needs(scene)
      ->excludes(app->get_option("--ticks"));
  app->add_option("--scenes", o->size.scenes,
                  "number of our own scenes; those beyond the fixed ones are drawn from the seed")
      ->check(CLI::Range(std::size_t{1}, std::size_t{10000}))
      ->excludes(scene);
  app->add_option_function<double>(
         "--friction", [o](double mu) { o->size.frictions = {mu}; },
         "Coulomb coefficient (default: 0 and 0.3)")
      ->check(tools::number_within(0.0, 2.0))
      ->excludes(scene);
  tools::add_choice(
      *app, "--as", o->size.as, {{"solid", PartKind::kSolid}, {"surface", PartKind::kSurface}},
      "how the parts of our own scenes are compiled: solid leaves out the open meshes "
      "(default solid)");
  app->add_flag("--strict", o->size.strict,
                "triangles may not even touch, as a surface that keeps its distance must not");
  app->add_flag("--compare", o->compare,
                "forces of the same parts as solids and as --as says, on four contacts");
  const auto run = [o, words]() mutable {
    if (o->compare) {
      words.files = {"surface_compare.*"};
      return run_campaign(words, *o, [&] {
        return surface_comparison_end(compare_surfaces(o->size.as, !o->fault.empty(), o->run()));
      });
    }
    return run_campaign(words, *o, [&] {
      SurfaceFuzzSize size = o->size;
      size.only = o->only;
      size.fault = surface_fault_named(o->fault);
      return surface_fuzz_end(run_surface_fuzz(size, o->run()));
    });
  };
  return {app, run, words.example};
}

}  // namespace haptic::sim
