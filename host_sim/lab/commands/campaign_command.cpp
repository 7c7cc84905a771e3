// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/commands/campaign_command.hpp"

#include "tools/common/file_roles.hpp"

namespace haptic::sim {

CLI::App* add_campaign(CLI::App& program, const CampaignWords& words, CampaignArguments& arguments,
                       std::uint64_t& seed) {
  CLI::App* app = program.add_subcommand(words.name, words.does);
  app->add_option("--seed", seed, "of all random draws (default 1)");
  if (words.only != nullptr) app->add_option("--only", arguments.only, words.only);
  app->add_option("-o,--out", arguments.out, words.out);
  app->add_option("--threads", arguments.threads, "threads (default: one per processor)")
      ->check(CLI::Range(1, 256));
  app->add_option("--fault", arguments.fault, words.fault)->check(CLI::IsMember(words.faults));
  return app;
}

CLI::Option* add_count(CLI::App& app, const char* name, std::uint64_t& target, std::uint64_t most,
                       const char* help) {
  return app.add_option(name, target, help)->check(CLI::Range(std::uint64_t{1}, most));
}

int run_campaign(const CampaignWords& words, const CampaignArguments& arguments,
                 const std::function<CampaignEnd()>& run) {
  tools::claim_folder(arguments.out, "--out", words.files);
  return finish_campaign(run(), arguments.out, !arguments.fault.empty());
}

}  // namespace haptic::sim
