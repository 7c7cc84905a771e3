// SPDX-License-Identifier: Apache-2.0
// host_sim reproduce-paper --out DIR [--quick]
#include <cstdio>
#include <memory>
#include <string>

#include "host_sim/lab/studies/commands/study_commands.hpp"
#include "host_sim/lab/studies/reproduction/reproduction.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

struct ReproducePaperArguments {
  std::string out;
  bool quick = false;
};

int do_reproduce_paper(const ReproducePaperArguments& o) {
  const bool passed = reproduce_paper(o.out, {o.quick, true});
  std::printf("%s/README.md: %s\n", o.out.c_str(),
              passed ? "everything that must hold does" : "something that must hold does not");
  return passed ? tools::kExitDone : tools::kExitCheckFailed;
}

}  // namespace

Command add_reproduce_paper_command(CLI::App& program) {
  const auto o = std::make_shared<ReproducePaperArguments>();
  CLI::App* app = program.add_subcommand(
      "reproduce-paper", "Makes every table and figure of the paper, ours next to the paper's.");
  app->add_option("-o,--out", o->out,
                  "folder for the index, tables (Markdown, CSV) and pictures (SVG)")
      ->required();
  app->add_flag("--quick", o->quick, "small counts, a few seconds");
  return {app, [o] { return do_reproduce_paper(*o); }, "host_sim reproduce-paper --out paper"};
}

}  // namespace haptic::sim
