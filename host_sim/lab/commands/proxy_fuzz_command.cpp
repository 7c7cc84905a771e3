// SPDX-License-Identifier: Apache-2.0
// host_sim proxy-fuzz [--ticks N] [--seed S] [--friction MU] [--out DIR] [--threads N]
//                     [--fault certificate|spring|vertex]
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>

#include "host_sim/lab/commands/lab_commands.hpp"
#include "host_sim/lab/proxy_fuzz/proxy_campaign.hpp"
#include "tools/common/file_roles.hpp"

namespace haptic::sim {
namespace {

struct ProxyFuzzArguments {
  std::string out, fault;
  ProxyFuzzSize size;
  double friction = -1;  ///< < 0: the default ones
  std::uint32_t threads = std::max(1u, std::thread::hardware_concurrency());
};

void print(const ProxyFuzzResult& result, double seconds) {
  const auto number = [](std::uint64_t n) { return static_cast<unsigned long long>(n); };
  const ProxyFuzzTotals t = result.totals();
  std::printf("%s\n%s\n", campaign_line(result.size.seed, t.ticks, t.held, seconds).c_str(),
              zero_line(counts_of(kProxyMustBeZero, t)).c_str());
  std::printf(
      "worst gap %.4Lg um, on the ways of %llu passes %.4Lg um, largest rise %.3Lg J (%.3Lg of "
      "rounding), longest stall %llu, all "
      "passes rejected for %llu ticks, %llu passes in all\n",
      t.worst_gap_m * 1e6L, number(t.paths), t.worst_path_m * 1e6L, t.largest_rise_j,
      t.largest_rise_share, number(t.longest_stall), number(t.longest_rejected),
      number(t.rejected_passes));
  std::printf("peaks: rounds %u, rows %u, QP steps %u, plane gaps %u, valid nodes %u\n",
              t.peaks.proxy_rounds, t.peaks.proxy_rows, t.peaks.qp_iterations, t.peaks.plane_gaps,
              t.peaks.valid_nodes);
  if (result.size.budgets) {
    std::printf(
        "ended for want of budget: %llu ticks, %llu in a row at most; arrived %llu ticks after the "
        "device at most\n",
        number(t.behind), number(t.longest_behind), number(t.longest_arrival));
  }
  for (const std::string& line : t.failures.lines()) std::printf("  %s\n", line.c_str());
}

int do_proxy_fuzz(const ProxyFuzzArguments& o) {
  tools::claim_folder(o.out, "--out", {"proxy_fuzz.*"});
  ProxyFuzzSize size = o.size;
  if (o.friction >= 0) size.frictions = {o.friction};
  if (!o.fault.empty()) size.fault = proxy_fault_named(o.fault);
  const auto start = std::chrono::steady_clock::now();
  const ProxyFuzzResult result = run_proxy_fuzz(size, {o.threads, true});
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
  print(result, elapsed.count());
  if (!o.out.empty()) write_proxy_fuzz(o.out, result);
  return campaign_exit(result.totals().failed() == 0, size.fault.has_value());
}

}  // namespace

Command add_proxy_fuzz_command(CLI::App& program) {
  const auto o = std::make_shared<ProxyFuzzArguments>();
  CLI::App* app = program.add_subcommand(
      "proxy-fuzz", "Random, jittering and jumping devices against the proxy; every tick judged.");
  app->add_option("--ticks", o->size.ticks, "ticks over all scenes (default 1000000)")
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1} << 40));
  app->add_option("--seed", o->size.seed, "of all random draws (default 1)");
  app->add_option("--friction", o->friction, "Coulomb coefficient (default: 0 and 0.3)")
      ->check(CLI::Range(0.0, 2.0));
  app->add_flag("--budgets", o->size.budgets,
                "a budget of work for every scene, 50 to 10000 units, and a rest after every run");
  app->add_option("-o,--out", o->out, "folder for proxy_fuzz.md, .csv and .json");
  app->add_option("--threads", o->threads, "threads (default: one per processor)")
      ->check(CLI::Range(1, 256));
  app->add_option("--fault", o->fault,
                  "damage the core on purpose and check: exit 1 when the fault is caught")
      ->check(CLI::IsMember({"certificate", "spring", "vertex"}));
  return {app, [o] { return do_proxy_fuzz(*o); }, "host_sim proxy-fuzz --out fuzz"};
}

}  // namespace haptic::sim
