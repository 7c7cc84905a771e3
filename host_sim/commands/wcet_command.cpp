// SPDX-License-Identifier: Apache-2.0
// host_sim wcet --scene S [--motion M] [--out DIR] [--quick] [--seconds N | --evaluations N]
//               [--seed N] [--repeats 7] [--flow-facts FILE] [--fault BOUND] [--once]
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>

#include "host_sim/commands/commands.hpp"
#include "host_sim/report/output_file.hpp"
#include "host_sim/wcet/flow_facts.hpp"
#include "host_sim/wcet/scene_motion.hpp"
#include "host_sim/wcet/wcet_table.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

constexpr double kMotionSeconds = 8, kQuickMotionSeconds = 2;
constexpr double kQuickSearchSeconds = 2, kQuickWakeupSeconds = 0.5;
constexpr std::size_t kQuickSameState = 200;

struct Options {
  std::string scene, motion, out, flow_facts, fault;
  std::uint32_t repeats = 7;
  AdversarialLimits search;
  bool once = false, quick = false;
};

int run_once(CoreSession& session, const std::vector<MotionSample>& motion) {
  session.core().reset();
  std::uint64_t hash = 0;
  for (std::size_t i = 0; i < motion.size(); ++i)
    hash = session.core().step(input_of(motion[i], i)).state_hash;
  std::printf("%zu ticks, final state hash %016llx\n", motion.size(),
              static_cast<unsigned long long>(hash));
  return tools::kExitDone;
}

WcetPlan plan_of(const Options& o) {
  WcetPlan plan;
  plan.scene = o.scene;
  plan.motion = o.motion.empty() ? "made from the scene" : o.motion;
  plan.repeats = o.repeats;
  plan.adversarial = o.search;
  plan.fault = o.fault;
  if (o.quick) {
    plan.most_same_state = kQuickSameState;
    plan.wakeup_seconds = kQuickWakeupSeconds;
    // The search visits every node of every pair: a minute where there are many pairs.
    plan.exhaustive = !o.motion.empty();
    plan.adversarial.seconds = kQuickSearchSeconds;
  }
  return plan;
}

int run(const Options& o) {
  CoreSession session(o.scene);
  if (!o.flow_facts.empty()) write_whole_file(o.flow_facts, flow_facts(session.view(), o.scene));
  const std::vector<MotionSample> motion =
      o.motion.empty()
          ? scene_motion(session, o.quick ? kQuickMotionSeconds : kMotionSeconds, o.search.seed)
          : read_motion_csv(o.motion);
  if (o.once) return run_once(session, motion);
  if (!o.out.empty()) {
    std::error_code error;
    std::filesystem::create_directories(o.out, error);
    if (error) throw tools::InputError(o.out + ": the folder cannot be made: " + error.message());
  }
  const WcetReport report = measure_wcet(session, motion, plan_of(o));
  std::fputs(wcet_table(report, session.view(), motion).c_str(), stdout);
  if (!o.out.empty()) write_wcet(o.out, report, motion);
  std::printf("%s\n", report.passed() ? "every bound holds" : "a bound is PASSED");
  return report.passed() ? tools::kExitDone : tools::kExitCheckFailed;
}

}  // namespace

Command add_wcet_command(CLI::App& program) {
  const auto o = std::make_shared<Options>();
  CLI::App* app = program.add_subcommand(
      "wcet", "Looks for the worst tick: counted work, time, and a search for bad motions.");
  app->add_option("--scene", o->scene, "compiled scene (.rtscene)")->required();
  app->add_option("--motion", o->motion,
                  "motion: t,x,y,z,qw,qx,qy,qz; default: one made from the scene");
  app->add_option("--repeats", o->repeats, "runs per tick (default 7)")
      ->check(CLI::Range(1, 10000));
  app->add_option("--out", o->out,
                  "folder for wcet.csv, wcet.json, wcet.svg, trace.json, wakeups.txt, motions");
  CLI::Option* quick = app->add_flag("--quick", o->quick, "short motion and search, fewer ticks");
  CLI::Option* seconds = app->add_option("--seconds", o->search.seconds,
                                         "length of the adversarial search (default 10)")
                             ->check(CLI::Range(0.1, 1e6))
                             ->excludes(quick);
  app->add_option("--evaluations", o->search.evaluations,
                  "motions that each climb of the search tries, instead of a length")
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1'000'000'000}))
      ->excludes(seconds);
  app->add_option("--seed", o->search.seed, "of the search and of a motion made (default 1)");
  app->add_option("--flow-facts", o->flow_facts,
                  "file for the loop bounds of the scene, for static analysis");
  app->add_option("--fault", o->fault,
                  "takes this bound of the header for 0, so that the check must fail");
  app->add_flag("--once", o->once, "run the motion once without timing, for instruction counts");
  return {app, [o] { return run(*o); }};
}

}  // namespace haptic::sim
