// SPDX-License-Identifier: Apache-2.0
// host_sim verify
#include <memory>

#include "host_sim/lab/commands/campaign_command.hpp"
#include "host_sim/lab/commands/lab_commands.hpp"
#include "host_sim/lab/verification/deliberate_fault.hpp"
#include "host_sim/lab/verification/verification.hpp"

namespace haptic::sim {

Command add_verify_command(CLI::App& program) {
  const CampaignWords words{
      "verify",
      "Checks certificates, D_near and near sets of the core by independent code.",
      "host_sim verify --queries 1000000 --out verify",
      "folder for verify.json, verify.md and tables (CSV)",
      {"verify*"},
      {"key", "arc", "support"}};
  struct Asked : CampaignArguments {
    VerificationSize size;
    bool quick = false;
  };
  const auto o = std::make_shared<Asked>();
  CLI::App* app = add_campaign(program, words, *o, o->size.seed);
  CLI::Option* quick = app->add_flag("--quick", o->quick, "small counts, a few seconds");
  const auto count = [&](const char* name, std::uint64_t& target, const char* help) {
    app->add_option(name, target, help)->excludes(quick);
  };
  count("--queries", o->size.queries, "verdicts (default 1000000)");
  count("--judged", o->size.judged, "of them judged by the exhaustive search (default 100000)");
  count("--ticks", o->size.ticks, "ticks of D_near (default 200000)");
  count("--near-poses", o->size.near_poses, "near sets (default 100000)");
  const auto run = [o, words] {
    if (!o->fault.empty())
      return finish_campaign(fault_end(run_with_fault(fault_named(o->fault).value(), o->size.seed),
                                       o->fault, o->size.seed),
                             "", true);
    if (o->out.empty()) throw tools::UsageError("verify needs --out or --fault");
    return run_campaign(words, *o, [&] {
      VerificationSize size = o->size;
      if (o->quick) {
        size = VerificationSize::quick();
        size.seed = o->size.seed;
      }
      return verification_end(run_verification(size, o->run()), o->out);
    });
  };
  return {app, run, words.example};
}

}  // namespace haptic::sim
