// SPDX-License-Identifier: Apache-2.0
// host_sim growth --out DIR [--quick] [--most-exponent 2.5]
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "host_sim/lab/commands/lab_commands.hpp"
#include "host_sim/lab/growth/growth_study.hpp"
#include "host_sim/report/part_report.hpp"
#include "tools/common/command_line.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"

namespace haptic::sim {
namespace {

struct GrowthArguments {
  std::string out;
  bool quick = false;
  double most_exponent = 2.5;
};

int do_growth(const GrowthArguments& o) {
  tools::claim_folder(o.out, "--out", {"growth.csv"});
  std::vector<GrowthRun> runs;
  for (const GrowthSeries& series : growth_series(o.quick)) {
    runs.push_back(run_growth(series));
    write_whole_file(o.out + "/growth.csv", growth_csv(runs));
  }
  std::fputs(growth_table(runs).c_str(), stdout);
  const bool held = grows_as_it_should(runs, o.most_exponent);
  std::printf("%s/growth.csv: %s\n", o.out.c_str(),
              held ? "every part is compiled, and no time grows faster than it may"
                   : "A CHECK FAILED: a part is refused, or a time grows faster than it may");
  return held ? tools::kExitDone : tools::kExitCheckFailed;
}

}  // namespace

Command add_growth_command(CLI::App& program) {
  const auto o = std::make_shared<GrowthArguments>();
  CLI::App* app = program.add_subcommand(
      "growth",
      "Compiles parts that get larger: time, memory, bytes, and the powers they grow with.");
  app->add_option("-o,--out", o->out, "folder for growth.csv")->required();
  app->add_flag("--quick", o->quick, "small parts, for tests");
  app->add_option("--most-exponent", o->most_exponent,
                  "power of the size that the time may grow with (default 2.5)")
      ->check(tools::number_within(0.0, 10.0));
  app->footer(
      "Combs with 100 to 1000 reflex edges as solids, spheres of 10 000 to 1 000 000 facets as\n"
      "surfaces, each with a box above. graph_compiler must lie next to this program. About two\n"
      "minutes and 5 GB.\n"
      "Exit codes: 0 done, 1 a part is refused, or a time grows faster than it may, 2 usage,\n"
      "3 bad input, 4 refused by the system.");
  return {app, [o] { return do_growth(*o); }, "host_sim growth --quick --out growth"};
}

}  // namespace haptic::sim
