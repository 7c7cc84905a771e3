// SPDX-License-Identifier: Apache-2.0
// host_sim wcet --scene S [--motion M] [--out DIR] [--quick] [--seconds N | --evaluations N]
//               [--seed N] [--repeats 7] [--flow-facts FILE] [--fault BOUND] [--no-instructions]
//               [--once]
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>

#include "host_sim/lab/commands/lab_commands.hpp"
#include "host_sim/lab/wcet/flow_facts.hpp"
#include "host_sim/lab/wcet/scene_motion.hpp"
#include "host_sim/lab/wcet/wcet_report.hpp"
#include "host_sim/report/part_report.hpp"
#include "host_sim/session/moving_parts.hpp"
#include "tools/common/command_line.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"

namespace haptic::sim {
namespace {

constexpr double kMotionSeconds = 8, kQuickMotionSeconds = 2;
constexpr double kQuickSearchSeconds = 2, kQuickWakeupSeconds = 0.5;
constexpr std::size_t kQuickSameState = 50;

struct WcetArguments {
  std::string scene, motion, out, flow_facts, fault;
  std::uint32_t repeats = 7;
  AdversarialLimits search;
  bool once = false, quick = false, no_instructions = false, goal_contact = false;

  [[nodiscard]] GoalContact goal() const {
    return goal_contact ? GoalContact::kAsked : GoalContact::kLeftOut;
  }
};

/// This program on the same motion, for counting its instructions.
InstructionQuestion instruction_question(const WcetArguments& o) {
  InstructionQuestion question;
  std::error_code error;
  question.program = std::filesystem::read_symlink("/proc/self/exe", error).string();
  if (error) throw tools::InputError("/proc/self/exe: " + error.message());
  question.arguments = {"wcet", "--once", "--scene", o.scene};
  const auto add = [&](const std::string& word) { question.arguments.push_back(word); };
  if (o.goal_contact) add("--goal-contact");
  if (!o.motion.empty()) {
    add("--motion");
    add(o.motion);
  } else {
    add("--seed");
    add(std::to_string(o.search.seed));
    if (o.quick) add("--quick");
  }
  return question;
}

/// On a terminal one line that is written over; else a line every half minute.
void show(const AdversarialProgress& p) {
  static double shown_s = 0;
  const bool terminal = ::isatty(STDERR_FILENO) == 1;
  if (!terminal && p.elapsed_s - shown_s < 30) return;
  shown_s = p.elapsed_s;
  std::fprintf(stderr, "%ssearch %5.0f s  %-18s best %.6g %s of %llu motions%s",
               terminal ? "\r\x1b[K" : "", p.elapsed_s, to_text(p.goal), p.best, unit_of(p.goal),
               static_cast<unsigned long long>(p.evaluations), terminal ? "\r" : "\n");
}

WcetPlan plan_of(const WcetArguments& o) {
  WcetPlan plan;
  if (!o.no_instructions) plan.instructions = instruction_question(o);
  plan.scene = o.scene;
  plan.motion = o.motion.empty() ? "made from the scene" : o.motion;
  plan.repeats = o.repeats;
  plan.goal = o.goal();
  plan.adversarial = o.search;
  plan.adversarial.progress = show;
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

int do_wcet(const WcetArguments& o) {
  CoreSession session(o.scene, o.goal());
  require_one_moving_part(session, o.scene, "wcet", kJudgeBodies);
  tools::claim_output(o.flow_facts, "--flow-facts", tools::text_kind("# flow facts"));
  tools::claim_folder(
      o.out, "--out",
      {"wcet.csv", "wcet.json", "wcet.svg", "trace.json", "wakeups.txt", "adversarial_*.csv"});
  const std::vector<MotionSample> motion =
      o.motion.empty()
          ? scene_motion(session, o.quick ? kQuickMotionSeconds : kMotionSeconds, o.search.seed)
          : read_played_motion(o.motion);
  if (!o.flow_facts.empty()) write_whole_file(o.flow_facts, flow_facts(session.view(), o.scene));
  if (o.once) {
    std::printf("%zu ticks, final state hash %016llx\n", motion.size(),
                static_cast<unsigned long long>(run_once(session, motion, o.goal())));
    return tools::kExitDone;
  }
  const WcetReport report = measure_wcet(session, motion, plan_of(o));
  std::fputs(wcet_table(report, session.view(), motion).c_str(), stdout);
  if (!o.out.empty()) write_wcet(o.out, report, motion);
  std::printf("%s\n", report.passed() ? "every bound holds" : "a bound is PASSED");
  return report.passed() ? tools::kExitDone : tools::kExitCheckFailed;
}

}  // namespace

Command add_wcet_command(CLI::App& program) {
  const auto o = std::make_shared<WcetArguments>();
  CLI::App* app = program.add_subcommand(
      "wcet", "Looks for the worst tick: counted work, time, and a search for bad motions.");
  app->add_option("scene,--scene", o->scene, "compiled scene (.rtscene)")->required();
  app->add_option("--motion", o->motion,
                  "motion: t,x,y,z,qw,qx,qy,qz; default: one made from the scene");
  app->add_option("--repeats", o->repeats, "runs per tick (default 7)")
      ->check(CLI::Range(1, 10000));
  app->add_option("-o,--out", o->out, "folder for the files below");
  CLI::Option* quick = app->add_flag("--quick", o->quick, "short motion and search, fewer ticks");
  CLI::Option* seconds = app->add_option("--seconds", o->search.seconds,
                                         "length of the adversarial search (default 10)")
                             ->check(tools::number_within(0.1, 1e6))
                             ->excludes(quick);
  app->add_option("--evaluations", o->search.evaluations,
                  "motions that each climb of the search tries, instead of a length")
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1'000'000'000}))
      ->excludes(seconds);
  app->add_option("--seed", o->search.seed, "of the search and of a motion made (default 1)");
  app->add_option("--flow-facts", o->flow_facts,
                  "file for the loop bounds of the scene, for static analysis");
  app->add_option("--fault", o->fault, "self-test: treats this bound as 0, so the check must fail");
  app->add_flag("--no-instructions", o->no_instructions,
                "leave out the count of instructions under valgrind");
  app->add_flag("--goal-contact", o->goal_contact,
                "law proxy: time and count ticks that also search the contact at the goal pose");
  app->add_flag("--once", o->once,
                "run the motion once without timing: ticks and final state hash alone");
  app->footer(
      "Printed: work per tick against its bounds; stack of a tick; instructions per tick and by\n"
      "function; time per tick against the exhaustive search, the worst tick with its input; "
      "noise\n"
      "of the machine; its wake-ups; what the adversarial search found. On stderr: how far the\n"
      "search is.\n"
      "Files in --out:\n"
      "  wcet.csv      a line per tick: times, work, instructions\n"
      "  wcet.json     the same as one object, with every function\n"
      "  wcet.svg      histograms of the times\n"
      "  trace.json    a bar per tick with its counts, for Perfetto or chrome://tracing\n"
      "  wakeups.txt   as cyclictest writes it\n"
      "  adversarial_GOAL_seedN.csv  the motions found, for replay\n"
      "Exit codes: 0 every bound holds, 1 one is exceeded, a wrench is not finite or a repeat\n"
      "differs, 2 usage, 3 bad input.");
  return {app,
          [o] { return do_wcet(*o); },
          "host_sim wcet --scene peg.rtscene --quick",
          {{"--script",
            "it plays a motion: make it with 'host_sim motion SCRIPT.toml -o motion.csv'"}}};
}

}  // namespace haptic::sim
