// SPDX-License-Identifier: Apache-2.0
// host_sim hold [--poses N] [--seed S] [--only K] [--out DIR] [--threads N] [--fault
// restless|spring|certificate]
#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>

#include "host_sim/lab/commands/lab_commands.hpp"
#include "host_sim/lab/proxy_fuzz/hold_campaign.hpp"
#include "host_sim/report/campaign_text.hpp"
#include "tools/common/file_roles.hpp"

namespace haptic::sim {
namespace {

struct HoldArguments {
  std::string out, fault;
  HoldSize size;
  std::uint64_t only = 0;
  CLI::Option* only_given = nullptr;
  std::uint32_t threads = std::max(1u, std::thread::hardware_concurrency());
};

int do_hold(const HoldArguments& o) {
  tools::claim_folder(o.out, "--out", {"hold.*", "hold_ticks.csv"});
  HoldSize size = o.size;
  if (o.only_given->count() > 0) size.only = o.only;
  if (!o.fault.empty()) size.fault = proxy_fault_named(o.fault);
  const HoldResult result = run_hold(size, {o.threads, true});
  std::printf("%s", hold_page(result).c_str());
  if (!o.out.empty()) write_hold(o.out, result);
  return campaign_exit(result.totals().failed() == 0, size.fault.has_value());
}

}  // namespace

Command add_hold_command(CLI::App& program) {
  const auto o = std::make_shared<HoldArguments>();
  CLI::App* app = program.add_subcommand(
      "hold", "Holds the device still after stress: a fixed point, balanced, no energy gained.");
  app->add_option("--poses", o->size.poses, "poses over all scenes (default 10000)")
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1} << 30));
  app->add_option("--seed", o->size.seed, "of all random draws (default 1)");
  o->only_given =
      app->add_option("--only", o->only,
                      "the pose of this number, as a failure names it, and hold_ticks.csv of it");
  app->add_option("-o,--out", o->out, "folder for hold.md, .csv and .json");
  app->add_option("--threads", o->threads, "threads (default: one per processor)")
      ->check(CLI::Range(1, 256));
  app->add_option("--fault", o->fault,
                  "damage the core on purpose and check: exit 1 when the fault is caught")
      ->check(CLI::IsMember({"restless", "spring", "certificate"}));
  return {app, [o] { return do_hold(*o); }, "host_sim hold --out hold"};
}

}  // namespace haptic::sim
