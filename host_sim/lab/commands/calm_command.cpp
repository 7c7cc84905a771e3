// SPDX-License-Identifier: Apache-2.0
// host_sim calm --out DIR [--quick]
#include <cstdio>
#include <memory>
#include <string>

#include "host_sim/lab/calm/calm_report.hpp"
#include "host_sim/lab/commands/lab_commands.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"

namespace haptic::sim {
namespace {

struct CalmArguments {
  std::string out;
  bool quick = false;
};

int do_calm(const CalmArguments& o) {
  tools::claim_folder(o.out, "--out", {});
  std::vector<CalmResult> results;
  unsigned failed = 0;
  for (const CalmCell& cell : calm_cells(o.quick)) {
    results.push_back(run_calm(cell));
    const CalmResult& r = results.back();
    failed += r.passed() ? 0u : 1u;
    std::printf(
        "  %-7s %-4s %5g N/m delay %u %3g um %-5s %-6s: %8.4f N without, %8.4f N of %.4f; free "
        "%u ticks, %.3g N; acted %u%s; %s\n",
        cell.allow_active ? "asked" : "default", cell.contact.c_str(), r.k_t_n_per_m,
        cell.delay_samples, 1e6 * cell.encoder_step_m, cell.hand.c_str(),
        r.inside ? "inside" : "beyond", r.without.rest_pp_n, r.with.rest_pp_n, r.allowed_pp_n,
        r.with.free_ticks, r.with.free_n, r.with.acted_ticks, r.same_bits ? ", same bits" : "",
        r.passed() ? "passed" : "FAILED");
  }
  for (const OutputText& file : calm_files(results))
    write_whole_file(o.out + "/" + file.name, file.content);
  const LastResort beyond = last_resort(results);
  if (!beyond.passed()) ++failed;
  std::printf("beyond the budget: %u of %u do not rest without the layer, %u with it; %s\n",
              beyond.without, beyond.cells, beyond.with, beyond.passed() ? "passed" : "FAILED");
  std::printf("%s/calm.md: %u failed, %zu cells\n", o.out.c_str(), failed, results.size());
  return failed == 0 ? tools::kExitDone : tools::kExitCheckFailed;
}

}  // namespace

Command add_calm_command(CLI::App& program) {
  const auto o = std::make_shared<CalmArguments>();
  CLI::App* app = program.add_subcommand(
      "calm",
      "Presses, holds and withdraws by every hand and encoder: rest, and nothing in free "
      "space.");
  app->add_option("-o,--out", o->out, "folder for calm.csv, calm.json, calm.md and calm.svg")
      ->required();
  app->add_flag("--quick", o->quick, "only the corners of the table");
  return {app, [o] { return do_calm(*o); }, "host_sim calm --quick --out calm"};
}

}  // namespace haptic::sim
