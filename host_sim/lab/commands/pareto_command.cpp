// SPDX-License-Identifier: Apache-2.0
// host_sim pareto --out DIR [--quick] [--pairs W1,W4] [--seed N]
#include <sched.h>

#include <cstdio>
#include <memory>
#include <string>

#include "host_sim/lab/commands/lab_commands.hpp"
#include "host_sim/lab/optional/studies.hpp"
#include "host_sim/lab/pareto/pareto_report.hpp"
#include "host_sim/timing/heap_interposer.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

struct ParetoArguments {
  ParetoOptions pareto;
  std::string out;
};

/// Keeps the program on the core that it runs on now: caches and time stamps of one core.
void pin_to_this_core() {
#if defined(__linux__)
  const int core = ::sched_getcpu();
  cpu_set_t set;
  CPU_ZERO(&set);
  if (core >= 0) CPU_SET(static_cast<unsigned>(core), &set);
  if (core < 0 || ::sched_setaffinity(0, sizeof set, &set) != 0)
    std::fprintf(stderr, "not pinned to one core: times scatter more\n");
#endif
}

int do_pareto(const ParetoArguments& o) {
  for (const PeerLibrary& library : peer_libraries()) {
    std::printf("%-8s %s\n", library.name.c_str(),
                library.built ? (library.version + ", " + library.licence).c_str()
                              : "not found when this program was built");
  }
  std::fflush(stdout);
  pin_to_this_core();
  write_pareto(measure_pareto(o.pareto), o.out);
  std::printf("%s/pareto.md\n", o.out.c_str());
  if (o.pareto.pairs.empty() && !studies_built())
    std::printf("not run: %s\n", study_left_out("each of pair classes W1 to W6").c_str());
  return tools::kExitDone;
}

}  // namespace

Command add_pareto_command(CLI::App& program) {
  const auto o = std::make_shared<ParetoArguments>();
  o->pareto.progress = true;
  if (heap_calls_are_counted()) o->pareto.heap_calls = heap_calls_of_this_thread;
  CLI::App* app = program.add_subcommand(
      "pareto", "Error against run time of the core and of other collision methods.");
  app->add_option("-o,--out", o->out, "folder for tables (CSV, JSON, Markdown) and pictures (SVG)")
      ->required();
  app->add_flag("--quick", o->pareto.quick, "2000 poses a pair, within a minute");
  app->add_option("--pairs", o->pareto.pairs,
                  "headline, opponents, or pair classes, such as W1,W4 (default all of this build)")
      ->delimiter(',')
      ->check(CLI::IsMember({"W1", "W2", "W3", "W4", "W5", "W6", kHeadlineName, kOpponentsName}));
  app->add_option("--seed", o->pareto.seed, "of bodies and motions (default 1)");
  return {app, [o] { return do_pareto(*o); }, "host_sim pareto --quick --out pareto"};
}

}  // namespace haptic::sim
