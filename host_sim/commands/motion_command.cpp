// SPDX-License-Identifier: Apache-2.0
// host_sim motion SCRIPT.toml -o M.csv; host_sim motion --for SCENE.rtscene -o M.csv;
// host_sim motion --from LOG -o M.csv
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <string>
#include <string_view>

#include "host_sim/commands/commands.hpp"
#include "host_sim/commands/motion_from_log.hpp"
#include "host_sim/session/motion_csv.hpp"
#include "host_sim/session/motion_script.hpp"
#include "host_sim/touching/touching_motion.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"
#include "tools/common/progress_line.hpp"

namespace haptic::sim {
namespace {

struct MotionArguments {
  std::string script, scene, out;
  LogArguments log;
};

void claim_motion(const std::string& out) {
  tools::claim_output(out, "--out", tools::csv_kind("t,x,y,z"));
}

void say_samples(const std::string& out, const std::vector<MotionSample>& motion, double rate_hz) {
  std::printf("%s: %zu samples, %.3f s at %g Hz\n", out.c_str(), motion.size(),
              motion.back().t_s - motion.front().t_s, rate_hz);
}

/// Prints the motion of the hand, and the contact that the core finds in it.
void say_touching(const TouchingScript& touching, const std::vector<TickRecord>& ticks) {
  double force_n = 0, torque_nm = 0;
  std::size_t in_contact = 0;
  for (const TickRecord& tick : ticks) {
    force_n = std::max(force_n, length_of(tick.force_n));
    torque_nm = std::max(torque_nm, length_of(tick.torque_nm));
    in_contact += tick.in_contact ? 1 : 0;
  }
  if (!touching.way_in.empty())
    std::printf("  way in    %zu straight ways to where the part belongs\n",
                touching.way_in.size() - 1);
  std::printf("  approach  %.4g mm along %s until the part touches\n", 1e3 * touching.way_m,
              way_text(touching.along_w).c_str());
  std::printf("  press     %.3g mm further\n", 1e3 * touching.press_m);
  std::printf("  slide     %.3g mm to four sides\n", 1e3 * touching.slide_m);
  std::printf("  tilt      %.3g rad\n", touching.tilt_rad);
  std::printf("  leave     back to the start\n");
  std::printf("played once: in contact in %.3g %% of the ticks, up to %.3g N and %.3g N m\n",
              100.0 * static_cast<double>(in_contact) / static_cast<double>(ticks.size()), force_n,
              torque_nm);
}

int motion_of_script(const MotionArguments& o) {
  const MotionScript script = read_motion_script(o.script);
  claim_motion(o.out);
  const std::vector<MotionSample> motion = make_motion(script);
  write_motion_csv(o.out, motion);
  say_samples(o.out, motion, script.rate_hz);
  return tools::kExitDone;
}

/// Says on standard error, about once a second, what is being done.
TouchProgress progress_lines() {
  using Clock = std::chrono::steady_clock;
  return [said = Clock::now()](const std::string& what) mutable {
    if (Clock::now() - said < std::chrono::seconds(1)) return;
    said = Clock::now();
    std::fprintf(stderr, "host_sim motion: %s\n", what.c_str());
  };
}

int motion_for_scene(const MotionArguments& o) {
  CoreSession session(o.scene);
  claim_motion(o.out);
  TouchingOptions options;
  options.find_way_in = find_way_in;
  options.progress = progress_lines();
  options.shows_ticks = tools::is_terminal(stderr);
  const TouchingMotion made = touching_motion(session, options);
  if (!made.no_way_in.empty()) std::printf("%s\n", made.no_way_in.c_str());
  if (!made.not_touched.empty()) {
    std::printf("FAILED: %s: %s; no motion is written\n", o.scene.c_str(),
                made.not_touched.c_str());
    return tools::kExitCheckFailed;
  }
  write_motion_csv(o.out, made.motion);
  say_samples(o.out, made.motion, made.touching.script.rate_hz);
  say_touching(made.touching, made.played.ticks);
  const tools::SessionVerdict verdict = made.played.verdict.value_or(tools::SessionVerdict{});
  std::printf("%s\n", tools::verdict_line(verdict).text.data());
  return verdict.failed() ? tools::kExitCheckFailed : tools::kExitDone;
}

}  // namespace

Command add_motion_command(CLI::App& program) {
  const auto o = std::make_shared<MotionArguments>();
  CLI::App* app = program.add_subcommand(
      "motion",
      "Makes a motion: from a script of way points, one that touches a scene's parts, or from a "
      "log of another program.");
  app->add_option("script,--script", o->script, "motion script (TOML)");
  app->add_option(
      "--for", o->scene,
      "compiled scene (.rtscene), instead of a script: to the fixed parts until the part "
      "touches, press, slide, tilt, leave");
  add_log_options(*app, o->log);
  app->add_option("-o,--out", o->out,
                  "motion to write: t,x,y,z,qw,qx,qy,qz; required, but of a log motion.csv");
  return {
      app,
      [o] {
        const int given = static_cast<int>(!o->script.empty()) +
                          static_cast<int>(!o->scene.empty()) +
                          static_cast<int>(!o->log.log.path.empty());
        if (given != 1)
          throw tools::UsageError(
              "give a motion script, or --for SCENE.rtscene, or --from LOG, and one of them alone");
        const bool log = !o->log.log.path.empty();
        if (o->out.empty() && !log) throw tools::UsageError("--out is required");
        if (o->out.empty()) o->out = "motion.csv";
        if (log) {
          claim_motion(o->out);
          return motion_from_log(o->log, o->out);
        }
        return o->scene.empty() ? motion_of_script(*o) : motion_for_scene(*o);
      },
      "host_sim motion --for peg.rtscene -o motion.csv"};
}

}  // namespace haptic::sim
