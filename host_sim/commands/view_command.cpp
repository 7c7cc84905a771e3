// SPDX-License-Identifier: Apache-2.0
// host_sim view SCENE|NUMBER [MOTION] [--html FILE] [--seconds N] [--list]
#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>

#include "host_sim/commands/commands.hpp"
#include "host_sim/report/part_report.hpp"
#include "host_sim/view/gallery.hpp"
#include "host_sim/view/recorded_ticks.hpp"
#include "tools/common/command_line.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"
#include "tools/live/page_file.hpp"

namespace haptic::sim {
namespace {

struct ViewArguments {
  std::string scene, motion, html;
  std::optional<double> seconds;
  bool list = false;
};

/// The samples of the first `seconds`; all where that is not given.
std::span<const MotionSample> begin_of(std::span<const MotionSample> motion,
                                       std::optional<double> seconds) {
  if (!seconds || motion.empty()) return motion;
  const double end_s = motion.front().t_s + *seconds;
  const auto end =
      std::ranges::find_if(motion, [&](const MotionSample& s) { return s.t_s > end_s; });
  return motion.first(static_cast<std::size_t>(end - motion.begin()));
}

int write_view(const std::string& html, CoreSession& session, std::span<const MotionSample> motion,
               std::string_view about) {
  std::vector<tools::RecordedTick> ticks;
  if (!motion.empty()) ticks = record_motion(session, motion);
  const std::string filled = tools::filled_page(tools::read_page(), session.view(), ticks, about);
  write_whole_file(html, filled);
  std::printf("%s: %zu ticks recorded, %zu kB; open it in a browser\n", html.c_str(), ticks.size(),
              filled.size() / 1024);
  return tools::kExitDone;
}

int do_view(const ViewArguments& o) {
  if (o.list) {
    std::printf("%s", gallery_list().c_str());
    return tools::kExitDone;
  }
  const std::optional<unsigned> number = gallery_number(o.scene);
  if (!number) {
    if (o.html.empty()) throw tools::UsageError("--html is required; example: --html peg.html");
    CoreSession session(o.scene);
    std::vector<MotionSample> motion;
    if (!o.motion.empty()) motion = read_played_motion(o.motion);
    tools::claim_output(o.html, "--html", {tools::FileFormat::kHtml, {}});
    return write_view(o.html, session, begin_of(motion, o.seconds), {});
  }
  const GalleryScene& scene = gallery_scene(*number);
  const std::string html = o.html.empty() ? std::string(scene.name) + ".html" : o.html;
  CompiledGalleryScene compiled = compile_gallery_scene(scene);
  if (!o.motion.empty()) compiled.motion = read_played_motion(o.motion);
  tools::claim_output(html, "--html", {tools::FileFormat::kHtml, {}});
  CoreSession session(compiled.bytes.span(), std::string(scene.name));
  return write_view(html, session, begin_of(compiled.motion, o.seconds),
                    std::string(scene.title) + ". " + std::string(scene.about));
}

}  // namespace

Command add_view_command(CLI::App& program) {
  const auto o = std::make_shared<ViewArguments>();
  CLI::App* app = program.add_subcommand(
      "view", "Makes a page to see a scene and move its part: one file, which runs the core.");
  CLI::Option* list = app->add_flag("--list", o->list, "only list the scenes of the gallery");
  CLI::Option* scene = app->add_option("scene,--scene", o->scene,
                                       "compiled scene (.rtscene), or the number of a scene of the "
                                       "gallery, 1 to 8");
  app->add_option("motion,--motion", o->motion,
                  "motion to record in the page: t,x,y,z,qw,qx,qy,qz of A's mesh frame in W");
  app->add_option("--html", o->html, "HTML file to write; of the gallery: NAME.html by default");
  app->add_option("--seconds", o->seconds,
                  "record the begin of the motion alone; default: all of it")
      ->check(tools::number_within(0.001, 3600.0));
  app->final_callback([list, scene] {
    if (list->count() == 0 && scene->count() == 0)
      throw tools::UsageError("scene is required: a compiled scene, or a number of the gallery");
  });
  return {app,
          [o] { return do_view(*o); },
          "host_sim view peg.rtscene motion.csv --html peg.html",
          {{"--script",
            "it plays a motion: make it with 'host_sim motion SCRIPT.toml -o motion.csv'"}}};
}

}  // namespace haptic::sim
