// SPDX-License-Identifier: Apache-2.0
// host_sim bodies [--study squeeze|push|carry|cost|size] [--short] [--no-instructions] [--out DIR]
//                 [--fault KIND]
#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "host_sim/lab/bodies_study/bodies_study.hpp"
#include "host_sim/lab/bodies_study/cost_cases.hpp"
#include "host_sim/lab/commands/lab_commands.hpp"
#include "host_sim/report/campaign_text.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"

namespace haptic::sim {
namespace {

struct BodiesArguments {
  std::vector<std::string> studies;
  std::string out, fault, peer;
  bool is_short = false, no_instructions = false;
  std::optional<std::size_t> once;
};

int do_bodies(const BodiesArguments& o) {
  if (o.once) {
    print_bodies_cost_run(*o.once, o.is_short, o.peer);
    return tools::kExitDone;
  }
  tools::claim_folder(o.out, "--out", {"bodies.csv", "bodies.json", "bodies.md"});
  BodiesStudySize size{o.is_short, !o.no_instructions, std::nullopt};
  if (!o.fault.empty()) size.fault = bodies_fault_named(o.fault);
  std::vector<BodiesStudy> studies;
  for (const std::string& name : bodies_study_names()) {
    if (o.studies.empty() || std::ranges::find(o.studies, name) != o.studies.end())
      studies.push_back(run_bodies_study(name, size));
  }
  return finish_campaign(bodies_study_end(studies), o.out, size.fault.has_value());
}

}  // namespace

Command add_bodies_command(CLI::App& program) {
  const auto o = std::make_shared<BodiesArguments>();
  CLI::App* app = program.add_subcommand(
      "bodies",
      "Drivers that squeeze, push and carry a hand's part, and what a tick of several bodies "
      "costs.");
  app->add_option("--study", o->studies, "one of them, may be given several times (default: all)")
      ->check(CLI::IsMember(bodies_study_names()))
      ->allow_extra_args(false);
  app->add_flag("--short", o->is_short, "a few rows of each");
  app->add_flag("--no-instructions", o->no_instructions,
                "leave out the count of instructions under valgrind in the studies cost and size");
  app->add_option("-o,--out", o->out, "folder for bodies.csv, bodies.json and bodies.md");
  CLI::Option* once = app->add_option(
      "--once", o->once,
      "run the case of this number of the studies cost and size alone: ticks and state hash");
  app->add_option("--peer", o->peer,
                  "with --once: by MuJoCo, default, stiff or fine, in place of the law")
      ->needs(once);
  app->add_option("--fault", o->fault,
                  "damage the law on purpose: exit 1 when a bound finds the fault")
      ->check(CLI::IsMember({"certificate"}));
  return {app, [o] { return do_bodies(*o); }, "host_sim bodies --study squeeze --out bodies"};
}

}  // namespace haptic::sim
