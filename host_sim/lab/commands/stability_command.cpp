// SPDX-License-Identifier: Apache-2.0
// host_sim stability --out DIR [--quick] [--parts 1,2] [--laws paper,proxy] [--threads N]
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <map>
#include <memory>
#include <string>
#include <thread>

#include "host_sim/lab/commands/lab_commands.hpp"
#include "host_sim/lab/optional/studies.hpp"
#include "host_sim/lab/stability/stability_report.hpp"
#include "host_sim/session/core_session.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {

Command add_stability_command(CLI::App& program) {
  struct StabilityArguments {
    std::string out;
    std::vector<int> parts;
    StabilityOptions run;
  };
  const auto o = std::make_shared<StabilityArguments>();
  o->run.threads = std::max(1u, std::thread::hardware_concurrency());
  CLI::App* app = program.add_subcommand(
      "stability", "Measures where the haptic loop is stable, compared with the theory.");
  app->add_option("-o,--out", o->out, "folder for tables (Markdown, CSV) and pictures (SVG)")
      ->required();
  app->add_flag("--quick", o->run.quick, "fewer cells, shorter runs");
  app->add_option("--parts", o->parts, "numbers of the parts to run; default: all of this build")
      ->delimiter(',');
  tools::add_choices<LawId>(
      *app, "--laws", o->run.laws,
      {{law_name(LawId::kPaper), LawId::kPaper}, {law_name(LawId::kProxy), LawId::kProxy}},
      "laws to look at; default: all");
  app->add_option("--threads", o->run.threads, "default: one per processor")
      ->check(CLI::Range(1u, 256u));
  return {app,
          [o] {
            o->run.progress = isatty(STDERR_FILENO) == 1;
            const bool passed = write_stability(o->out, o->parts, o->run);
            std::printf("%s/README.md: %s\n", o->out.c_str(),
                        passed ? "every stated limit holds" : "a stated limit is PASSED");
            if (o->parts.empty() && !studies_built())
              std::printf("not run: %s\n",
                          study_left_out("each of parts 1, 4, 5, 6 and 7").c_str());
            return static_cast<int>(passed ? tools::kExitDone : tools::kExitCheckFailed);
          },
          "host_sim stability --quick --out stability"};
}

}  // namespace haptic::sim
