// SPDX-License-Identifier: Apache-2.0
// host_sim motion SCRIPT.toml --out M.csv
#include <cstdio>
#include <memory>
#include <string>

#include "host_sim/commands/commands.hpp"
#include "host_sim/session/motion_csv.hpp"
#include "host_sim/session/motion_script.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"

namespace haptic::sim {

Command add_motion_command(CLI::App& program) {
  struct MotionArguments {
    std::string script, out;
  };
  const auto options = std::make_shared<MotionArguments>();
  CLI::App* app = program.add_subcommand("motion", "Makes a motion from a script of way points.");
  app->add_option("script", options->script, "motion script (TOML)")->required();
  app->add_option("-o,--out", options->out, "motion to write: t,x,y,z,qw,qx,qy,qz")->required();
  return {app,
          [options] {
            tools::claim_output(options->out, "--out");
            const MotionScript script = read_motion_script(options->script);
            const std::vector<MotionSample> motion = make_motion(script);
            write_motion_csv(options->out, motion);
            std::printf("%s: %zu samples, %.3f s at %g Hz\n", options->out.c_str(), motion.size(),
                        motion.back().t_s - motion.front().t_s, script.rate_hz);
            return static_cast<int>(tools::kExitDone);
          },
          "host_sim motion host_sim/scenes/square_peg_five/motion.toml --out motion.csv"};
}

}  // namespace haptic::sim
