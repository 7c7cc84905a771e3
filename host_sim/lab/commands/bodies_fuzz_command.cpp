// SPDX-License-Identifier: Apache-2.0
// host_sim bodies-fuzz
#include <memory>

#include "host_sim/lab/bodies_fuzz/bodies_campaign.hpp"
#include "host_sim/lab/bodies_fuzz/bodies_cases.hpp"
#include "host_sim/lab/commands/campaign_command.hpp"
#include "host_sim/lab/commands/lab_commands.hpp"
#include "tools/common/command_line.hpp"

namespace haptic::sim {

Command add_bodies_fuzz_command(CLI::App& program) {
  const CampaignWords words{
      "bodies-fuzz",
      "Random hands, drivers and loose parts against each other; every tick and step judged.",
      "host_sim bodies-fuzz --out bodies",
      "folder for bodies_fuzz.md, .csv and .json",
      {"bodies_fuzz.*"},
      {"certificate", "spring", "reaction", "restless", "goal", "bound"},
      "the run of this number, as a failure names it",
      "damage the law, or what is judged, on purpose: exit 1 when the fault is caught"};
  struct Asked : CampaignArguments {
    BodiesFuzzSize size;
  };
  const auto o = std::make_shared<Asked>();
  CLI::App* app = add_campaign(program, words, *o, o->size.seed);
  CLI::Option* cases =
      app->add_option("--case", o->size.cases, "case, may be given several times (default: all)")
          ->check(CLI::IsMember(bodies_case_names()))
          ->allow_extra_args(false);
  add_count(*app, "--ticks", o->size.ticks, std::uint64_t{1} << 40,
            "ticks over all scenes, rests on top (default 200000)");
  CLI::Option* friction = app->add_option_function<double>(
                                 "--friction", [o](double mu) { o->size.frictions = {mu}; },
                                 "Coulomb coefficient (default: 0 and 0.3)")
                              ->check(tools::number_within(0.0, 2.0));
  app->add_option("--scene", o->size.scene,
                  "compiled scene (.rtscene) whose parts move at once, in place of the cases: its "
                  "roles, springs, drivers and loose parts")
      ->excludes(cases)
      ->excludes(friction);
  app->add_option(
         "--work-units", o->size.work_units,
         "budget of a tick; what it has no room for is left to the next (default: none; of a "
         "scene, its own)")
      ->check(CLI::Range(kLeastWorkUnits, kMostWorkUnits));
  const auto run = [o, words] {
    return run_campaign(words, *o, [&] {
      BodiesFuzzSize size = o->size;
      size.only = o->only;
      size.fault = bodies_fault_named(o->fault);
      return bodies_fuzz_end(run_bodies_fuzz(size, o->run()));
    });
  };
  return {app, run, words.example};
}

}  // namespace haptic::sim
