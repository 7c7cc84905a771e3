// SPDX-License-Identifier: Apache-2.0
// host_sim continuity --out DIR [--quick]
#include <cstdio>
#include <memory>
#include <string>

#include "host_sim/lab/commands/lab_commands.hpp"
#include "host_sim/lab/continuity/continuity_report.hpp"
#include "host_sim/report/part_report.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"

namespace haptic::sim {
namespace {

struct ContinuityArguments {
  std::string out;
  bool quick = false;
};

int do_continuity(const ContinuityArguments& o) {
  tools::claim_folder(o.out, "--out", {});
  const std::vector<PathResult> results = run_paths(o.quick);
  for (const OutputText& file : continuity_files(results))
    write_whole_file(o.out + "/" + file.name, file.content);
  for (const PathResult& result : results) {
    const PathRun& finest = result.weighted.back();
    std::printf("  %-16s %6u steps: largest torque step %.4g mN m, paper %.4g: %s\n",
                result.path.name.c_str(), finest.steps, 1e3 * finest.largest_torque_step_nm,
                1e3 * result.paper.back().largest_torque_step_nm,
                settles(result.weighted, result.path.fine_steps) ? "settles" : "JUMPS");
  }
  const bool passed = continuous(results);
  std::printf("%s/README.md: the weighted law %s\n", o.out.c_str(),
              passed ? "has no jump on any path" : "jumps");
  return passed ? tools::kExitDone : tools::kExitCheckFailed;
}

}  // namespace

Command add_continuity_command(CLI::App& program) {
  const auto o = std::make_shared<ContinuityArguments>();
  CLI::App* app = program.add_subcommand(
      "continuity", "Measures the jumps of both contact laws on smooth paths.");
  app->add_option("-o,--out", o->out, "folder for tables (Markdown, CSV, JSON) and pictures (SVG)")
      ->required();
  app->add_flag("--quick", o->quick, "only the two step sizes per path that decide");
  return {app, [o] { return do_continuity(*o); }, "host_sim continuity --quick --out continuity"};
}

}  // namespace haptic::sim
