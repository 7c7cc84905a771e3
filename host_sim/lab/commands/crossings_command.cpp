// SPDX-License-Identifier: Apache-2.0
// host_sim crossings [--crossings N] [--seed S] [--only K] [--out DIR] [--threads N]
//                    [--fault certificate|vertex]
#include "host_sim/lab/proxy_fuzz/crossings.hpp"

#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>

#include "host_sim/lab/commands/lab_commands.hpp"
#include "host_sim/report/campaign_text.hpp"
#include "tools/common/file_roles.hpp"

namespace haptic::sim {
namespace {

struct CrossingArguments {
  std::string out, fault;
  CrossingSize size;
  std::uint64_t only = 0;
  CLI::Option* only_given = nullptr;
  std::uint32_t threads = std::max(1u, std::thread::hardware_concurrency());
};

int do_crossings(const CrossingArguments& o) {
  tools::claim_folder(o.out, "--out", {"crossings.*"});
  CrossingSize size = o.size;
  if (o.only_given->count() > 0) size.only = o.only;
  if (!o.fault.empty()) size.fault = proxy_fault_named(o.fault);
  const CrossingResult result = run_crossings(size, {o.threads, true});
  std::printf("%s", crossings_page(result).c_str());
  if (!o.out.empty()) write_crossings(o.out, result);
  return campaign_exit(result.totals().failed() == 0, size.fault.has_value());
}

}  // namespace

Command add_crossings_command(CLI::App& program) {
  const auto o = std::make_shared<CrossingArguments>();
  CLI::App* app = program.add_subcommand(
      "crossings",
      "Drives rods, blades and sheets through each other; the way of every pass judged.");
  app->add_option("--crossings", o->size.crossings,
                  "random ones; 4 for 10 more of rods and of nearly parallel edges (default 1000)")
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1} << 30));
  app->add_option("--seed", o->size.seed, "of all random draws (default 1)");
  o->only_given =
      app->add_option("--only", o->only, "the one of this number, as a failure names it");
  app->add_option("-o,--out", o->out, "folder for crossings.md, .csv and .json");
  app->add_option("--threads", o->threads, "threads (default: one per processor)")
      ->check(CLI::Range(1, 256));
  app->add_option("--fault", o->fault,
                  "damage the core on purpose and check: exit 1 when the fault is caught")
      ->check(CLI::IsMember({"certificate", "vertex"}));
  return {app, [o] { return do_crossings(*o); }, "host_sim crossings --out crossings"};
}

}  // namespace haptic::sim
