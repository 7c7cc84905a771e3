// SPDX-License-Identifier: Apache-2.0
// host_sim verify --out DIR [--queries N] [--judged N] [--ticks N] [--near-poses N] [--seed N]
//                 [--threads N] [--quick]
// host_sim verify --fault key|arc|support [--seed N]
#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>

#include "host_sim/lab/commands/lab_commands.hpp"
#include "host_sim/lab/verification/deliberate_fault.hpp"
#include "host_sim/lab/verification/verification.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"

namespace haptic::sim {
namespace {

struct VerifyArguments {
  std::string out, fault;
  VerificationSize size;
  std::uint32_t threads = std::max(1u, std::thread::hardware_concurrency());
  bool quick = false;
};

/// Exit 1 is right here: the checks must fail on a core with a fault in it.
int run_fault(const VerifyArguments& o) {
  const FaultOutcome outcome = run_with_fault(fault_named(o.fault).value(), o.size.seed);
  std::printf("fault %s, seed %llu: %llu checks, %llu fail without it, %llu with it\n",
              o.fault.c_str(), static_cast<unsigned long long>(o.size.seed),
              static_cast<unsigned long long>(outcome.checks),
              static_cast<unsigned long long>(outcome.sound_failures),
              static_cast<unsigned long long>(outcome.fault_failures));
  if (!outcome.first_failure.empty()) std::printf("  %s\n", outcome.first_failure.c_str());
  const bool failed = outcome.sound_failures + outcome.fault_failures > 0;
  if (!failed) std::printf("  the fault was not caught\n");
  return failed ? tools::kExitCheckFailed : tools::kExitDone;
}

void print(const VerificationResult& result) {
  const auto number = [](std::uint64_t n) { return static_cast<unsigned long long>(n); };
  const VerdictTotals v = result.verdict_totals();
  std::printf(
      "verdicts   %llu queries (%llu separated, %llu colliding, %llu touching, %llu "
      "undecided): %llu bad certificates; %llu judged: %llu wrong\n",
      number(v.queries), number(v.separated), number(v.colliding), number(v.touching),
      number(v.undecided), number(v.bad_certificates()), number(v.judged),
      number(v.wrong_verdicts + v.wrong_boundaries));
  const DepthTotals d = result.depth_totals();
  std::printf(
      "D_near     %llu ticks (%llu inside, %llu within 5 mm): %llu wrong, largest error "
      "%.2Lg m inside, %.2Lg m outside; %llu wrong bounds beyond\n",
      number(d.ticks), number(d.inside), number(d.near), number(d.wrong), d.largest_inside_m,
      d.largest_near_m, number(d.wrong_bounds));
  const NearTotals n = result.near_totals();
  std::printf(
      "near sets  %llu poses, %llu members: %llu missing, %llu extra, %llu of the subset "
      "missing; %llu ambiguous, %llu cut\n",
      number(n.poses), number(n.members), number(n.missing), number(n.extra),
      number(n.subset_missing), number(n.ambiguous), number(n.cut));
}

int do_verify(const VerifyArguments& o) {
  if (!o.fault.empty()) return run_fault(o);
  if (o.out.empty()) {
    std::fprintf(stderr, "host_sim: verify needs --out or --fault\n");
    return tools::kExitUsage;
  }
  tools::claim_folder(o.out, "--out", {"verify*"});
  const VerificationResult result = run_verification(o.size, {o.threads, true});
  write_verification(o.out, result);
  print(result);
  const bool passed = result.passed();
  std::printf(
      "%s/verify.md: %s\n", o.out.c_str(),
      passed ? "every count that must be zero is zero" : "a count that must be zero is not");
  return passed ? tools::kExitDone : tools::kExitCheckFailed;
}

}  // namespace

Command add_verify_command(CLI::App& program) {
  const auto o = std::make_shared<VerifyArguments>();
  CLI::App* app = program.add_subcommand(
      "verify", "Checks certificates, D_near and near sets of the core by independent code.");
  app->add_option("-o,--out", o->out, "folder for verify.json, verify.md and tables (CSV)");
  const auto size = [&](const char* name, std::uint64_t VerificationSize::*field,
                        const char* words) { return app->add_option(name, o->size.*field, words); };
  CLI::Option* given[] = {
      size("--queries", &VerificationSize::queries, "verdicts (default 1000000)"),
      size("--judged", &VerificationSize::judged,
           "of them judged by the exhaustive search (default 100000)"),
      size("--ticks", &VerificationSize::ticks, "ticks of D_near (default 200000)"),
      size("--near-poses", &VerificationSize::near_poses, "near sets (default 100000)")};
  size("--seed", &VerificationSize::seed, "of all random draws (default 1)");
  app->add_option("--threads", o->threads, "threads (default: one per processor)")
      ->check(CLI::Range(1, 256));
  CLI::Option* quick = app->add_flag("--quick", o->quick, "small counts, a few seconds");
  for (CLI::Option* option : given) quick->excludes(option);
  app->add_option("--fault", o->fault,
                  "damage the core on purpose and check: exit 1 when the fault is caught")
      ->check(CLI::IsMember({"key", "arc", "support"}));
  return {app,
          [o] {
            if (o->quick) {
              const std::uint64_t seed = o->size.seed;
              o->size = VerificationSize::quick();
              o->size.seed = seed;
            }
            return do_verify(*o);
          },
          "host_sim verify --queries 1000000 --out verify"};
}

}  // namespace haptic::sim
