// SPDX-License-Identifier: Apache-2.0
// host_sim pegs --out DIR [--quick] [--length-share L] [--progress]
#include <cstdio>
#include <memory>
#include <string>

#include "host_sim/lab/studies/commands/study_commands.hpp"
#include "host_sim/lab/studies/pegs/peg_table.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"

namespace haptic::sim {
namespace {

struct PegsArguments {
  std::string out;
  bool quick = false, progress = false;
  double length_share = 0;
};

int do_pegs(const PegsArguments& o) {
  tools::claim_folder(o.out, "--out", {});
  const std::vector<PegResult> results = run_pegs(o.quick, o.progress, o.length_share);
  for (const OutputText& file : peg_files(results))
    write_whole_file(o.out + "/" + file.name, file.content);
  const PegVerdict v = verdict_of(results);
  std::printf("largest step without a device: proxy %.4g N, %.4g mN m; paper %.4g N, %.4g mN m\n",
              v.proxy_step_n, 1e3 * v.proxy_step_nm, v.paper_step_n, 1e3 * v.paper_step_nm);
  std::printf("median force: proxy %.4g N, paper %.4g N; holds that outlast the push: %u\n",
              v.proxy_median_n, v.paper_median_n, v.outlasting);
  std::printf("%s/pegs.md: %s\n", o.out.c_str(), v.passed() ? "passed" : "FAILED");
  return v.passed() ? tools::kExitDone : tools::kExitCheckFailed;
}

}  // namespace

Command add_pegs_command(CLI::App& program) {
  const auto o = std::make_shared<PegsArguments>();
  CLI::App* app = program.add_subcommand(
      "pegs", "Leads pegs into their holes and tells what the hand feels: steps, holds, forces.");
  app->add_option("-o,--out", o->out, "folder for tables (Markdown, CSV, JSON) and pictures (SVG)")
      ->required();
  app->add_flag("--quick", o->quick, "few pegs, for tests");
  app->add_option("--length-share", o->length_share,
                  "length of the coupling in radii of the part instead of the default")
      ->check(tools::positive_number());
  app->add_flag("--progress", o->progress, "a line per run on standard error");
  return {app, [o] { return do_pegs(*o); }, "host_sim pegs --quick --out pegs"};
}

}  // namespace haptic::sim
