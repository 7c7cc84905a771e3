// SPDX-License-Identifier: Apache-2.0
// host_sim view SCENE [MOTION] --html FILE
#include <cstdio>
#include <memory>
#include <string>

#include "host_sim/commands/commands.hpp"
#include "host_sim/report/part_report.hpp"
#include "host_sim/view/page_file.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"

namespace haptic::sim {
namespace {

struct ViewArguments {
  std::string scene, motion, html;
};

int do_view(const ViewArguments& o) {
  tools::claim_output(o.html, "--html");
  CoreSession session(o.scene);
  std::vector<RecordedTick> ticks;
  if (!o.motion.empty()) ticks = record_motion(session, read_played_motion(o.motion));
  const std::string filled = filled_page(read_page(), session.view(), ticks);
  write_whole_file(o.html, filled);
  std::printf("%s: %zu ticks recorded, %zu kB; open it in a browser\n", o.html.c_str(),
              ticks.size(), filled.size() / 1024);
  return tools::kExitDone;
}

}  // namespace

Command add_view_command(CLI::App& program) {
  const auto o = std::make_shared<ViewArguments>();
  CLI::App* app = program.add_subcommand(
      "view", "Makes a page to see a scene and move its part: one file, which runs the core.");
  app->add_option("scene,--scene", o->scene, "compiled scene (.rtscene)")->required();
  app->add_option("motion,--motion", o->motion,
                  "motion to record in the page: t,x,y,z,qw,qx,qy,qz of A's mesh frame in W");
  app->add_option("--html", o->html, "HTML file to write")->required();
  return {app, [o] { return do_view(*o); }, "host_sim view peg.rtscene motion.csv --html peg.html"};
}

}  // namespace haptic::sim
