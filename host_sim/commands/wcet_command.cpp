// SPDX-License-Identifier: Apache-2.0
// host_sim wcet --scene S --motion M [--repeats 7] [--out DIR] [--once]
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>

#include "host_sim/commands/commands.hpp"
#include "host_sim/commands/wcet.hpp"
#include "host_sim/report/output_file.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

struct Options {
  std::string scene, motion, out;
  std::uint32_t repeats = 7;
  bool once = false;
};

void print_row(const char* name, const TimeFigures& f) {
  if (f.count == 0) return;
  std::printf("  %-28s %8zu %10.0f %10.0f %10.0f %10.0f\n", name, f.count, f.median, f.p99, f.p999,
              f.largest);
}

void print(const WcetResult& r, const std::vector<MotionSample>& motion) {
  std::printf(
      "time per tick in ns: least of %u runs from the same state and input, then over the inputs\n",
      r.repeats);
  std::printf("  %-28s %8s %10s %10s %10s %10s\n", "", "inputs", "median", "p99", "p99.9",
              "largest");
  print_row("core, all ticks", r.core);
  print_row("core, without the first", r.core_after_first);
  print_row("core, in contact", r.core_contact);
  print_row("core, free", r.core_free);
  print_row("core, every bound stale", r.stale);
  print_row("exhaustive search, double", r.exhaustive);
  print_row("noise: repeat less the least", r.noise);
  std::printf("  first tick %.0f ns; worst later tick %zu (t = %.3f s, %.0f ns%s)\n",
              r.first_tick_ns, r.worst_tick, motion[r.worst_tick].t_s,
              r.ticks[r.worst_tick].core_ns,
              r.ticks[r.worst_tick].relocalised ? ", re-localised" : "");
  if (r.core.median > 0) {
    std::printf("  exhaustive / core: median %.2f, largest %.2f\n",
                r.exhaustive.median / r.core.median, r.exhaustive.largest / r.core.largest);
  }
  std::printf("  empty measurement %.1f ns, subtracted\n", r.clock_empty_ns);
}

/// The bounds of the scene's header beside the largest counts, and what they would cost.
void print_bounds(const WcetResult& r, const SceneView& view) {
  const SceneCapacity& c = view.header().capacity;
  std::printf("work per tick                       largest      bound\n");
  const auto row = [](const char* name, std::uint32_t peak, std::uint32_t bound) {
    std::printf("  %-28s %12u %10u%s\n", name, peak, bound, peak > bound ? "  OVER ITS BOUND" : "");
  };
  row("pairs visited", r.peaks.pair_visits, c.max_pair_visits);
  row("faces and edges evaluated", r.peaks.feature_evaluations, c.max_feature_evaluations);
  row("pairs of edges", r.peaks.edge_pairs, c.max_edge_pairs);
  row("support pairs", r.peaks.support_pairs, c.max_support_pairs);
  row("near nodes", r.peaks.near_nodes, c.max_near_nodes);
  row("points of one contact region", r.peaks.hull_points, c.max_hull_points);
  if (view.parameters().law == LawId::kProxy) {
    row("passes of the proxy", r.peaks.proxy_passes, view.parameters().coupling.passes);
    row("gaps along planes", r.peaks.plane_gaps, c.max_plane_gaps);
    row("nodes of valid sets", r.peaks.valid_nodes, c.max_valid_nodes);
    row("searches without history", r.peaks.full_searches, c.max_full_searches);
  }
  const double period_ns = 1e9 / view.parameters().rate_hz;
  const double bound_ns = r.dearest_unit_ns * static_cast<double>(work_bound(c));
  std::printf(
      "  %u pairs, %llu bytes of state, %llu bytes of scene; %s\n", c.pair_count,
      static_cast<unsigned long long>(c.state_bytes),
      static_cast<unsigned long long>(view.header().byte_count),
      c.unproven == 0 ? "exact at every pose" : "a tick may have to give up exactness, flagged");
  std::printf(
      "  bound %llu units of work, dearest unit %.1f ns: at most %.0f ns, %.1f %% of the "
      "period of %.0f ns\n",
      static_cast<unsigned long long>(work_bound(c)), r.dearest_unit_ns, bound_ns,
      100 * bound_ns / period_ns, period_ns);
}

std::string csv(const WcetResult& r, const std::vector<MotionSample>& motion) {
  std::string text = "tick,t_s,core_ns,exhaustive_ns,contact,relocalised\n";
  for (std::size_t i = 0; i < r.ticks.size(); ++i) {
    char line[160];
    std::snprintf(line, sizeof line, "%zu,%.6f,%.1f,%.1f,%d,%d\n", i, motion[i].t_s,
                  r.ticks[i].core_ns, r.ticks[i].exhaustive_ns, r.ticks[i].contact ? 1 : 0,
                  r.ticks[i].relocalised ? 1 : 0);
    text += line;
  }
  return text;
}

int run(const Options& o) {
  CoreSession session(o.scene);
  const std::vector<MotionSample> motion = read_motion_csv(o.motion);
  if (o.once) {
    session.core().reset();
    std::uint64_t hash = 0;
    for (std::size_t i = 0; i < motion.size(); ++i)
      hash = session.core().step(input_of(motion[i], i)).state_hash;
    std::printf("%zu ticks, final state hash %016llx\n", motion.size(),
                static_cast<unsigned long long>(hash));
    return tools::kExitDone;
  }
  if (!o.out.empty()) {
    std::error_code error;
    std::filesystem::create_directories(o.out, error);
    if (error) throw tools::InputError(o.out + ": the folder cannot be made: " + error.message());
  }
  const WcetResult result = measure(session, motion, o.repeats);
  print(result, motion);
  print_bounds(result, session.view());
  if (!o.out.empty()) write_whole_file(o.out + "/wcet.csv", csv(result, motion));
  return within_bounds(result.peaks, session.view().header().capacity) ? tools::kExitDone
                                                                       : tools::kExitCheckFailed;
}

}  // namespace

Command add_wcet_command(CLI::App& program) {
  const auto o = std::make_shared<Options>();
  CLI::App* app = program.add_subcommand(
      "wcet", "Times the tick, beside an exhaustive search of the same poses.");
  app->add_option("--scene", o->scene, "compiled scene (.rtscene)")->required();
  app->add_option("--motion", o->motion, "motion: t,x,y,z,qw,qx,qy,qz")->required();
  app->add_option("--repeats", o->repeats, "runs per tick (default 7)")
      ->check(CLI::Range(1, 10000));
  app->add_option("--out", o->out, "folder for wcet.csv, one line per tick");
  app->add_flag("--once", o->once, "run the motion once without timing, for instruction counts");
  return {app, [o] { return run(*o); }};
}

}  // namespace haptic::sim
