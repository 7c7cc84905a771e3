// SPDX-License-Identifier: Apache-2.0
// host_sim strangers [--families NAME,..] [--seeds N] [--seed S] [--clearance MM|all] [--hand H,..]
//                    [--friction MU] [--short] [--full] [--set LINES] [--out DIR] [--keep DIR]
//                    [--threads N] [--study freeze|seams|recovery [--instructions]]
//                    [--fault KIND]
#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>

#include "host_sim/lab/commands/lab_commands.hpp"
#include "host_sim/lab/strangers/part_studies.hpp"
#include "host_sim/lab/strangers/stranger_campaign.hpp"
#include "host_sim/report/campaign_text.hpp"
#include "tools/common/command_line.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"

namespace haptic::sim {
namespace {

struct StrangersArguments {
  StrangerCampaign campaign;
  std::uint32_t seeds = 1;
  std::uint64_t first_seed = 1;
  std::string clearance, out, fault, study;
  bool instructions = false;
  std::uint32_t threads = std::max(1u, std::thread::hardware_concurrency());
};

/// Lines as an option has them: "\n" for the end of one.
std::string unescaped(std::string text) {
  for (std::size_t at = 0; (at = text.find("\\n", at)) != std::string::npos;)
    text.replace(at, 2, "\n");
  return text;
}

void read_clearance(const std::string& text, StrangerCampaign& campaign) {
  if (text.empty()) return;
  if (text == "all") {
    campaign.every_clearance = true;
    return;
  }
  constexpr double kLeast_mm = 0.001, kMost_mm = 2;
  std::size_t read = 0;
  double value = 0;
  try {
    value = std::stod(text, &read);
  } catch (const std::exception&) {
    read = 0;
  }
  if (read != text.size() || !(value >= kLeast_mm && value <= kMost_mm))
    throw tools::UsageError("--clearance " + text + ": give 0.001 to 2 mm, or all");
  campaign.clearances_mm = {value};
}

int do_study(const StrangersArguments& o) {
  tools::claim_folder(o.out, "--out", {"freeze.*", "seams.*", "recovery*"});
  StudySize size{o.campaign.trial.is_short, o.instructions, {}};
  if (!o.fault.empty()) size.fault = stranger_fault_named(o.fault);
  const RunOptions options{o.threads, true};
  const PartReport report = o.study == "freeze"  ? freeze_study(size, options)
                            : o.study == "seams" ? seam_study(size, options)
                                                 : recovery_study(size, options);
  return finish_study(report, o.study, o.out, size.fault.has_value());
}

int do_strangers(const StrangersArguments& o) {
  if (!o.study.empty()) return do_study(o);
  tools::claim_folder(o.out, "--out", {"strangers.csv", "strangers.md"});
  StrangerCampaign campaign = o.campaign;
  campaign.seeds.clear();
  for (std::uint32_t k = 0; k < o.seeds; ++k) campaign.seeds.push_back(o.first_seed + k);
  read_clearance(o.clearance, campaign);
  campaign.trial.more = unescaped(campaign.trial.more);
  if (!o.fault.empty()) campaign.trial.fault = stranger_fault_named(o.fault);
  const std::vector<StrangerTrial> trials =
      run_strangers(campaign, {o.threads, false}, [](const StrangerTrial& trial) {
        std::printf("%s\n", trial_line(trial).c_str());
        std::fflush(stdout);
      });
  const auto right = static_cast<std::size_t>(
      std::ranges::count_if(trials, [](const StrangerTrial& t) { return t.right(); }));
  std::printf("%zu of %zu right\n", right, trials.size());
  if (!o.out.empty()) {
    for (const OutputText& file : stranger_files(trials))
      write_whole_file(o.out + "/" + file.name, file.content);
  }
  return campaign_exit(right == trials.size(), campaign.trial.fault.has_value());
}

}  // namespace

Command add_strangers_command(CLI::App& program) {
  const auto o = std::make_shared<StrangersArguments>();
  CLI::App* app = program.add_subcommand(
      "strangers",
      "Brings pairs of parts as people draw them, by defaults: what the programs give is judged.");
  std::vector<std::string> names;
  for (const std::string_view name : stranger_families()) names.emplace_back(name);
  app->add_option("--families", o->campaign.families, "by name, with commas (default: all)")
      ->delimiter(',')
      ->check(CLI::IsMember(names));
  app->add_option("--seeds", o->seeds, "seeds of every family, one after another (default 1)")
      ->check(CLI::Range(1u, 100000u));
  app->add_option("--seed", o->first_seed, "the first of them (default 1)");
  app->add_option(
      "--clearance", o->clearance,
      "of all pairs in mm, or all: every one that belongs to a family (default: drawn)");
  TrialOptions& trial = o->campaign.trial;
  app->add_option("--hand", trial.hands, "of the closed loop, with commas (default light,firm)")
      ->delimiter(',')
      ->check(CLI::IsMember({"loose", "light", "firm"}));
  app->add_option("--friction", trial.friction, "of a second scene (default 0.2; 0: none)")
      ->check(tools::number_within(0.0, 2.0));
  app->add_flag("--short", trial.is_short, "the hand's motion and the open air alone");
  app->add_flag(
      "--full", trial.full,
      "compare with large budgets always, also with friction (default: where a run is odd)");
  app->add_option("--set", trial.more,
                  "lines of TOML for every scene, \\n between them, to try a remedy");
  app->add_option("-o,--out", o->out, "folder for strangers.csv and .md");
  app->add_option("--keep", trial.keep,
                  "folder in which all files of every pair stay, a folder each");
  app->add_option("--threads", o->threads, "pairs at once (default: one per processor)")
      ->check(CLI::Range(1, 256));
  CLI::Option* study =
      app->add_option("--study", o->study,
                      "one kind of fault instead of the families: parts with many near pairs "
                      "(freeze), steps between faces (seams), starts inside (recovery)")
          ->check(CLI::IsMember({"freeze", "seams", "recovery"}));
  app->add_flag("--instructions", o->instructions,
                "count the instructions of a tick in the study freeze (needs valgrind)")
      ->needs(study);
  app->add_option("--fault", o->fault,
                  "make a fault of this kind on purpose: exit 1 when it is found")
      ->check(CLI::IsMember(stranger_fault_names()));
  return {app, [o] { return do_strangers(*o); },
          "host_sim strangers --families keyed_shaft --out strangers"};
}

}  // namespace haptic::sim
