// SPDX-License-Identifier: Apache-2.0
// host_sim accept [--parts DIR] [--scale METRES_PER_UNIT] [--damaged N] [--seed S] [--seconds S]
//                 [--out DIR]
#include <cstdio>
#include <memory>
#include <string>

#include "host_sim/lab/acceptance/acceptance.hpp"
#include "host_sim/lab/commands/lab_commands.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"

namespace haptic::sim {
namespace {

struct AcceptArguments {
  AcceptanceSize size;
  std::string out;
};

int do_accept(const AcceptArguments& o) {
  tools::claim_folder(o.out, "--out", {"accept.*"});
  AcceptanceSize size = o.size;
  size.progress = true;
  size.limits.waiting_seconds = 10 * size.limits.seconds;
  const AcceptanceResult result = run_acceptance(size);
  std::fputs(acceptance_page(result).c_str(), stdout);
  if (!o.out.empty()) {
    for (const OutputText& file : acceptance_files(result)) {
      write_whole_file(o.out + "/" + file.name, file.content);
    }
  }
  return result.failures() == 0 ? tools::kExitDone : tools::kExitCheckFailed;
}

}  // namespace

Command add_accept_command(CLI::App& program) {
  const auto o = std::make_shared<AcceptArguments>();
  CLI::App* app = program.add_subcommand(
      "accept", "Which meshes the compiler takes, as what, and whether what it says is true.");
  app->add_option("--parts", o->size.folder,
                  "folder of mesh files to compile one by one (default: meshes of our own)");
  app->add_option("--scale", o->size.scale_to_m,
                  "metres per unit of files that state none (default 1)")
      ->check(tools::positive_number());
  app->add_option("--damaged", o->size.damaged,
                  "meshes of our own, damaged at random, to compile too (default 100)")
      ->check(CLI::Range(0, 1000000));
  app->add_option("--seed", o->size.seed, "of the damage (default 1)");
  app->add_option("--seconds", o->size.limits.seconds,
                  "processor time after which a mesh counts as not ended (default 120)")
      ->check(CLI::Range(1, 86400));
  app->add_option("-o,--out", o->out, "folder for accept.csv, .json and .md");
  return {app, [o] { return do_accept(*o); }, "host_sim accept --parts parts --out accepted"};
}

}  // namespace haptic::sim
