// SPDX-License-Identifier: Apache-2.0
#include "host_sim/commands/motion_from_log.hpp"

#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string_view>
#include <utility>
#include <vector>

#include "host_sim/motion_log/log_judgement.hpp"
#include "host_sim/motion_log/log_number.hpp"
#include "host_sim/motion_log/log_rows.hpp"
#include "host_sim/motion_log/motion_log.hpp"
#include "host_sim/motion_log/resampled.hpp"
#include "host_sim/session/core_session.hpp"
#include "host_sim/session/motion_csv.hpp"
#include "tools/common/command_line.hpp"
#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"

namespace haptic::sim {
namespace {

constexpr double kPlayedRate_hz = 1000;

/// Numbers of an option, separated by commas; lengths in metres, or with mm behind them.
std::vector<double> option_numbers(const std::string& option, const std::string& text,
                                   std::size_t count, bool lengths) {
  std::vector<double> numbers;
  std::string_view rest = text;
  for (bool more = true; more;) {
    const std::size_t comma = rest.find(',');
    std::string_view word = trimmed(rest.substr(0, comma));
    more = comma != std::string_view::npos;
    if (more) rest.remove_prefix(comma + 1);
    const bool millimetres = lengths && word.ends_with("mm");
    if (millimetres) word.remove_suffix(2);
    const std::optional<double> number = log_number(word, false);
    if (!number) {
      throw tools::UsageError(option + " '" + text + "': '" + std::string(word) + "' is no number");
    }
    numbers.push_back(millimetres ? 1e-3 * *number : *number);
  }
  if (numbers.size() != count) {
    throw tools::UsageError(option + " '" + text + "': has " + std::to_string(numbers.size()) +
                            " numbers; give " + std::to_string(count) + ", separated by commas");
  }
  return numbers;
}

std::optional<Placement> told_placement(const LogArguments& o) {
  if (o.place.empty() && o.turn.empty()) return std::nullopt;
  Placement placement;
  if (!o.place.empty()) {
    const std::vector<double> way = option_numbers("--place", o.place, 3, true);
    std::copy_n(way.begin(), 3, placement.p_m.begin());
  }
  if (!o.turn.empty()) {
    const std::vector<double> turn = option_numbers("--turn", o.turn, 4, false);
    const double length = std::hypot(std::hypot(turn[0], turn[1]), std::hypot(turn[2], turn[3]));
    if (!(length > 1e-9)) throw tools::UsageError("--turn '" + o.turn + "': is no rotation");
    for (std::size_t k = 0; k < 4; ++k) placement.q_wxyz[k] = turn[k] / length;
  }
  return placement;
}

void warn(const LogArguments& o, const std::string& text) {
  std::fprintf(stderr, "host_sim: warning: %s: %s\n", o.log.path.c_str(), text.c_str());
}

std::string unit_text(const LogColumns& columns) {
  const char* name = "m";
  if (columns.unit_m == 1e-2) name = "cm";
  if (columns.unit_m == 1e-3) name = "mm";
  if (columns.unit_m == 1e-6) name = "um";
  return name + std::string(columns.unit_told ? "" : " (assumed)");
}

void say_log(const MotionLog& log, const LogFigures& f) {
  const LogColumns& columns = log.columns;
  std::printf("  read      %s: %zu samples in %.6g s, %.4g Hz, %s\n", log.path.c_str(),
              log.samples.size(), f.duration_s, f.rate_hz, log.form.c_str());
  std::printf("  time      %s, %s\n",
              columns.time_text.empty() ? "none" : columns.time_text.c_str(), log.clock.c_str());
  std::printf("  position  %s, in %s\n", columns.position_text.c_str(), unit_text(columns).c_str());
  std::printf("  turn      w, x, y, z are %s%s\n", columns.quaternion_text.c_str(),
              columns.order ? tools::formatted(" (%s)", order_text(*columns.order)).c_str() : "");
  if (log.normalised > 0) {
    std::printf("            normalised: %zu lengths up to %.3g off 1\n", log.normalised,
                std::abs(log.worst_length - 1));
  }
  if (log.turned > 0) std::printf("            signs made continuous at %zu samples\n", log.turned);
  std::printf("  gap       longest %.4g ms, before line %zu\n", 1e3 * f.longest_gap_s, f.gap_line);
  std::printf("  path      %.4g mm, up to %.3g m/s, within %.4g m of the origin\n", 1e3 * f.way_m,
              f.fastest_m_per_s, f.farthest_m);
}

std::optional<SceneStart> start_of(const std::string& path) {
  if (path.empty()) return std::nullopt;
  const CoreSession session(path);
  return scene_start(session.view());
}

/// Moves the samples as the options say. @return the placement, where there is one.
std::optional<Placement> place_log(const LogArguments& o, const std::optional<SceneStart>& scene,
                                   MotionLog& log) {
  std::optional<Placement> placement = told_placement(o);
  if (!o.start_at.empty()) placement = placement_between(log.samples.front(), scene->start);
  if (placement) place(log.samples, *placement);
  return placement;
}

}  // namespace

void add_log_options(CLI::App& app, LogArguments& o) {
  LogOptions& log = o.log;
  CLI::Option* from = app.add_option(
      "--from", log.path, "log of another program: CSV by column names, TUM, EuRoC, JSON lines");
  const auto with_log = [from](CLI::Option* option) { return option->needs(from); };
  with_log(app.add_option("--columns", log.columns,
                          "names of all columns in their order (t,x,y,z,qx,qy,qz,qw), or those in "
                          "use (t=STAMP,x=TCP_X,..)"))
      ->delimiter(',');
  with_log(app.add_option("--key", log.key, "JSON: the array with x, y, z and the quaternion"));
  with_log(tools::add_choice<std::optional<QuaternionOrder>>(
      app, "--order", log.order,
      {{"xyzw", QuaternionOrder::kXyzw}, {"wxyz", QuaternionOrder::kWxyz}},
      "order of the quaternion's columns in the file, against their names"));
  with_log(tools::add_choice<std::optional<double>>(
      app, "--unit", log.unit_m, {{"m", 1}, {"cm", 1e-2}, {"mm", 1e-3}, {"um", 1e-6}},
      "unit of the positions; default m, or as the columns' names say"));
  with_log(tools::add_choice<std::optional<double>>(
      app, "--time-unit", log.time_unit_s, {{"s", 1}, {"ms", 1e-3}, {"us", 1e-6}, {"ns", 1e-9}},
      "unit of the times; default by name and size"));
  with_log(app.add_option("--rows-hz", log.rows_hz, "rows a second of a log without times"))
      ->check(tools::positive_number());
  with_log(app.add_option("--rate", o.rate_hz,
                          "rate of the motion [Hz]; default 1000, the one that is played"))
      ->check(tools::positive_number());
  CLI::Option* placed =
      with_log(app.add_option("--place", o.place, "X,Y,Z: added to all positions, after --turn"));
  CLI::Option* turned =
      with_log(app.add_option("--turn", o.turn, "QW,QX,QY,QZ: turns all poses about W's origin"));
  CLI::Option* scene = with_log(app.add_option(
      "--scene", o.scene, "compiled scene (.rtscene) whose start the first pose is compared with"));
  with_log(app.add_option("--start-at", o.start_at,
                          "compiled scene (.rtscene): turns and moves all poses so that the first "
                          "is its start"))
      ->excludes(placed)
      ->excludes(turned)
      ->excludes(scene);
}

int motion_from_log(const LogArguments& o, const std::string& out) {
  (void)told_placement(o);  // refused before the log is read
  const std::optional<SceneStart> scene = start_of(o.start_at.empty() ? o.scene : o.start_at);
  MotionLog log = read_motion_log(o.log);
  const bool moved = !o.place.empty() || !o.turn.empty() || !o.start_at.empty();
  const std::optional<std::string> order =
      order_warning(log, moved ? std::optional<SceneStart>() : scene);
  const double farthest_m = log_figures(log).farthest_m;
  const std::optional<Placement> placement = place_log(o, scene, log);
  const LogFigures figures = log_figures(log);
  require_near(log, figures);
  const double rate_hz = o.rate_hz.value_or(kPlayedRate_hz);
  if (resampled_count(log.samples, rate_hz) > static_cast<double>(kMostResampled)) {
    throw tools::InputError(o.log.path + ": would be more than " + std::to_string(kMostResampled) +
                            " samples at " + tools::short_number(rate_hz, 6) +
                            " Hz; cut the log, or correct its times");
  }
  if (resampled_count(log.samples, rate_hz) < 2) {
    throw tools::InputError(o.log.path + ": lasts " + tools::short_number(figures.duration_s, 3) +
                            " s, less than a sample at " + tools::short_number(rate_hz, 6) +
                            " Hz; correct the unit of its times with --time-unit");
  }
  const std::vector<MotionSample> motion = resampled(log.samples, rate_hz);
  write_motion_csv(out, motion);
  std::printf("%s: %zu samples, %.3f s at %g Hz\n", out.c_str(), motion.size(), motion.back().t_s,
              rate_hz);
  say_log(log, figures);
  if (placement) {
    const auto& p = placement->p_m;
    const auto& q = placement->q_wxyz;
    std::printf("  placed    by --turn %.9g,%.9g,%.9g,%.9g --place %.9g,%.9g,%.9g\n", q[0], q[1],
                q[2], q[3], p[0], p[1], p[2]);
  }
  if (scene) {
    const StartDistance away = distance_from(*scene, log.samples.front());
    std::printf("  start     %.4g mm and %.3g rad from that of the scene\n", 1e3 * away.way_m,
                away.turn_rad);
  }
  for (const std::string& text : log_warnings(log, figures, scene)) warn(o, text);
  if (placement && farthest_m > kFarthestLog_m && !log.columns.unit_told) {
    warn(o, tools::formatted("before it was moved, positions reached %.4g m from the origin; where "
                             "these are millimetres, say --unit mm, else --unit m",
                             farthest_m));
  }
  if (order) warn(o, *order);
  if (scene && !order) {
    if (const auto text = start_warning(*scene, log.samples.front())) warn(o, *text);
  }
  if (rate_hz != kPlayedRate_hz) {
    warn(o, tools::formatted("a motion of %g Hz is not played by replay and view, which take %g Hz",
                             rate_hz, kPlayedRate_hz));
  }
  return tools::kExitDone;
}

}  // namespace haptic::sim
