// SPDX-License-Identifier: Apache-2.0
// host_sim surface-fuzz [SCENE.toml] [--ticks N] [--seed S] [--scenes K] [--friction MU] [--as
// KIND]
//                       [--strict] [--only RUN] [--compare] [--out DIR] [--threads N]
//                       [--fault displaced|goal|restless|certificate]
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>

#include "host_sim/lab/commands/lab_commands.hpp"
#include "host_sim/lab/surface_fuzz/surface_campaign.hpp"
#include "host_sim/lab/surface_fuzz/surface_comparison.hpp"
#include "tools/common/file_roles.hpp"

namespace haptic::sim {
namespace {

struct SurfaceFuzzArguments {
  std::string out, fault;
  SurfaceFuzzSize size;
  std::size_t scenes = 0;  ///< 0: the fixed ones
  double friction = -1;    ///< < 0: the default ones
  bool compare = false;
  std::uint64_t only = 0;
  CLI::Option* only_given = nullptr;
  std::uint32_t threads = std::max(1u, std::thread::hardware_concurrency());
};

void print(const SurfaceFuzzResult& result, double seconds) {
  const auto number = [](std::uint64_t n) { return static_cast<unsigned long long>(n); };
  const SurfaceTotals t = result.totals();
  std::printf("%s\n%s\n", campaign_line(result.size.seed, t.ticks, t.held, seconds).c_str(),
              zero_line(counts_of(kSurfaceMustBeZero, t)).c_str());
  std::printf(
      "worst gap %.4Lg um, on the ways of %llu passes %.4Lg um (%llu parts unproven), triangles "
      "met in %llu ticks, largest rise %.3Lg J\n",
      t.worst_gap_m * 1e6L, number(t.ways), t.worst_way_m * 1e6L, number(t.unproven),
      number(t.meeting), t.largest_rise_j);
  std::printf("at rest at most %.4Lg um off, after %llu ticks; ended for want of budget: %llu\n",
              t.largest_rest_gap_m * 1e6L, number(t.longest_arrival), number(t.behind));
  for (const std::string& line : t.failures.lines()) std::printf("  %s\n", line.c_str());
}

int do_comparison(const SurfaceFuzzArguments& o) {
  tools::claim_folder(o.out, "--out", {"surface_compare.*"});
  const SurfaceComparison comparison =
      compare_surfaces(o.size.as, !o.fault.empty(), {o.threads, true});
  std::printf("%s", surface_comparison_page(comparison).c_str());
  if (!o.out.empty()) write_surface_comparison(o.out, comparison);
  return campaign_exit(!comparison.failed(), !o.fault.empty());
}

int do_surface_fuzz(const SurfaceFuzzArguments& o) {
  if (o.compare) return do_comparison(o);
  tools::claim_folder(o.out, "--out",
                      {"surface_fuzz.*", "scene.toml", "part.obj", "around.obj", "motion.csv"});
  SurfaceFuzzSize size = o.size;
  if (o.only_given->count() > 0) size.only = o.only;
  if (o.scenes > 0) size.scenes = o.scenes;
  if (o.friction >= 0) size.frictions = {o.friction};
  if (!o.fault.empty()) size.fault = surface_fault_named(o.fault);
  const auto start = std::chrono::steady_clock::now();
  const SurfaceFuzzResult result = run_surface_fuzz(size, {o.threads, true});
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
  print(result, elapsed.count());
  if (!o.out.empty()) write_surface_fuzz(o.out, result);
  return campaign_exit(result.totals().failed() == 0, size.fault.has_value());
}

}  // namespace

Command add_surface_fuzz_command(CLI::App& program) {
  const auto o = std::make_shared<SurfaceFuzzArguments>();
  CLI::App* app = program.add_subcommand(
      "surface-fuzz",
      "Random devices against triangle meshes; every felt pose judged by triangles.");
  CLI::Option* scene = app->add_option("scene,--scene", o->size.scene_file,
                                       "scene file (.toml) to run instead of our own scenes");
  app->add_option("--ticks", o->size.ticks, "ticks over all scenes, rests on top (default 200000)")
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1} << 40));
  app->add_option("--seed", o->size.seed, "of all random draws (default 1)");
  CLI::Option* scenes =
      app->add_option(
             "--scenes", o->scenes,
             "number of our own scenes; those beyond the fixed ones are drawn from the seed")
          ->check(CLI::Range(std::size_t{1}, std::size_t{10000}));
  CLI::Option* friction =
      app->add_option("--friction", o->friction, "Coulomb coefficient (default: 0 and 0.3)")
          ->check(CLI::Range(0.0, 2.0));
  tools::add_choice(
      *app, "--as", o->size.as, {{"solid", PartKind::kSolid}, {"surface", PartKind::kSurface}},
      "how the parts of our own scenes are compiled: solid leaves out the open meshes "
      "(default solid)");
  app->add_flag("--strict", o->size.strict,
                "triangles may not even touch, as a surface that keeps its distance must not");
  o->only_given = app->add_option("--only", o->only,
                                  "the run of this number, as a failure names it; --out gets its "
                                  "scene and motion too");
  app->add_flag("--compare", o->compare,
                "forces of the same parts as solids and as --as says, on four contacts");
  app->add_option("-o,--out", o->out,
                  "folder for surface_fuzz.md, .csv and .json, or surface_compare.*");
  app->add_option("--threads", o->threads, "threads (default: one per processor)")
      ->check(CLI::Range(1, 256));
  app->add_option(
         "--fault", o->fault,
         "falsify what is judged, or the core, on purpose: exit 1 when the fault is caught")
      ->check(CLI::IsMember({"displaced", "goal", "restless", "certificate"}));
  scenes->excludes(scene);
  friction->excludes(scene);
  return {app, [o] { return do_surface_fuzz(*o); }, "host_sim surface-fuzz --out surfaces"};
}

}  // namespace haptic::sim
