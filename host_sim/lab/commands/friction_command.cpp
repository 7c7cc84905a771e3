// SPDX-License-Identifier: Apache-2.0
// host_sim friction --study fits|stops|loops|threads [--short] [--out DIR] [--threads N] [--fault
// KIND]
#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>

#include "host_sim/lab/commands/lab_commands.hpp"
#include "host_sim/lab/friction/friction_studies.hpp"
#include "host_sim/report/campaign_text.hpp"
#include "rt_core/scene/proxy_limits.hpp"
#include "tools/common/file_roles.hpp"

namespace haptic::sim {
namespace {

struct FrictionArguments {
  std::string study = "fits", out, fault;
  bool is_short = false;
  std::uint32_t work_units = 0;
  std::uint32_t threads = std::max(1u, std::thread::hardware_concurrency());
};

int do_friction(const FrictionArguments& o) {
  tools::claim_folder(o.out, "--out", {o.study + ".csv", o.study + ".md"});
  FrictionSize size{o.is_short, {}, o.work_units};
  if (!o.fault.empty()) size.fault = friction_fault_named(o.fault);
  const RunOptions options{o.threads, true};
  const PartReport report = o.study == "fits"    ? fit_study(size, options)
                            : o.study == "stops" ? stop_study(size, options)
                            : o.study == "loops" ? loop_study(size, options)
                                                 : thread_study(size, options);
  return finish_study(report, o.study, o.out, size.fault.has_value());
}

}  // namespace

Command add_friction_command(CLI::App& program) {
  const auto o = std::make_shared<FrictionArguments>();
  CLI::App* app = program.add_subcommand(
      "friction",
      "Slides, stops, leads around and screws parts in tight fits: friction against Coulomb's law, "
      "screw mechanics and energy.");
  app->add_option(
         "--study", o->study,
         "parts slid along their walls (fits, the default), stops, closed loops, or nuts (threads)")
      ->check(CLI::IsMember({"fits", "stops", "loops", "threads"}));
  app->add_flag("--short", o->is_short, "a few cells of it");
  app->add_option("-o,--out", o->out, "folder for a table (.csv) and a report (.md)");
  app->add_option("--work-units", o->work_units,
                  "of a tick (default: the compiler's), to tell what is late from what is wrong")
      ->check(CLI::Range(kLeastWorkUnits, kMostWorkUnits));
  app->add_option("--threads", o->threads, "cells at once (default: one per processor)")
      ->check(CLI::Range(1, 256));
  app->add_option("--fault", o->fault,
                  "make the scene wrong on purpose and check: exit 1 when the fault is found")
      ->check(CLI::IsMember({"coefficient", "budget", "creep", "late"}));
  return {app, [o] { return do_friction(*o); }, "host_sim friction --short"};
}

}  // namespace haptic::sim
