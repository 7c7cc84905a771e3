// SPDX-License-Identifier: Apache-2.0
#include "host_sim/motion_log/log_judgement.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "host_sim/motion_log/resampled.hpp"
#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"

namespace haptic::sim {
namespace {

// Beyond what hands, arms and trackers do, and within what they resolve.
constexpr double kFastMean_m_per_s = 2, kFastest_m_per_s = 20, kWide_m = 3, kTinyExtent_m = 2e-5;
// A gap is told as one from this length on, and this many usual steps.
constexpr double kLongGap_s = 0.1, kLongGapSteps = 5;
// Half a turn away as it is read, near as it is not.
constexpr double kFarTurn_rad = 2.6, kNearTurn_rad = 0.5;
// A log in millimetres, read as metres, lies this far outside the scene.
constexpr double kOutside = 20, kInside = 2;
// Rounding of times makes no longer gap.
constexpr double kSameStep = 1e-6;

double distance(const MotionSample& a, const MotionSample& b) {
  return std::hypot(a.p[0] - b.p[0], a.p[1] - b.p[1], a.p[2] - b.p[2]);
}

Eigen::Vector3d grip_of(const SceneStart& scene, const MotionSample& pose) {
  const double* q = pose.q_wxyz;
  const Eigen::Quaterniond turn(q[0], q[1], q[2], q[3]);
  return Eigen::Vector3d(pose.p[0], pose.p[1], pose.p[2]) +
         turn * Eigen::Vector3d(scene.grip_m[0], scene.grip_m[1], scene.grip_m[2]);
}

double norm_of(const double (&v)[3]) { return std::hypot(v[0], v[1], v[2]); }

/// The first orientation, read in the other order of the four columns.
MotionSample other_order(const MotionSample& sample, QuaternionOrder read) {
  const double* q = sample.q_wxyz;
  MotionSample other = sample;
  if (read == QuaternionOrder::kWxyz) {  // the file: q0 q1 q2 q3, of which the last is w
    const double turned[4] = {q[3], q[0], q[1], q[2]};
    std::copy_n(turned, 4, other.q_wxyz);
  } else {  // the file: q1 q2 q3 q0, of which the first is w
    const double turned[4] = {q[1], q[2], q[3], q[0]};
    std::copy_n(turned, 4, other.q_wxyz);
  }
  return other;
}

}  // namespace

std::optional<std::string> order_warning(const MotionLog& log,
                                         const std::optional<SceneStart>& scene) {
  if (!log.columns.order) return std::nullopt;
  const MotionSample from = scene ? scene->start : MotionSample{};
  const auto far_as_read = [&](const MotionSample& sample) {
    return turn_between(sample, from) > kFarTurn_rad &&
           turn_between(other_order(sample, *log.columns.order), from) < kNearTurn_rad;
  };
  // By a scene its start decides; without one, most of the motion.
  std::size_t far = 0;
  for (const MotionSample& sample : log.samples) far += far_as_read(sample) ? 1U : 0U;
  if (scene ? !far_as_read(log.samples.front()) : 10 * far < 9 * log.samples.size())
    return std::nullopt;
  const QuaternionOrder other = *log.columns.order == QuaternionOrder::kXyzw
                                    ? QuaternionOrder::kWxyz
                                    : QuaternionOrder::kXyzw;
  return tools::formatted(
      "read as %s, the quaternion turns the part by %.3g rad from the %s; as %s "
      "it would be %.2g rad: where the names are wrong, say --order %s",
      order_text(*log.columns.order), turn_between(log.samples.front(), from),
      scene ? "scene's start" : "axes of W", order_text(other),
      turn_between(other_order(log.samples.front(), *log.columns.order), from), order_text(other));
}

namespace {

void judge_unit(const MotionLog& log, const LogFigures& f, const std::optional<SceneStart>& scene,
                std::vector<std::string>& warnings) {
  const std::string fix = log.columns.unit_told ? "; is the unit right?"
                                                : "; where these are millimetres, say --unit mm";
  const double mean = f.way_m / f.duration_s;
  if (log.columns.unit_m < 1) {
    if (f.way_m > 0 && f.extent_m < kTinyExtent_m) {
      warnings.push_back(
          tools::formatted("the whole motion is within %.3g um; where the numbers "
                           "are metres, say --unit m or name the columns so",
                           1e6 * f.extent_m));
    }
  } else if (scene && f.farthest_m > kOutside * scene->reach_m &&
             1e-3 * f.farthest_m < kInside * scene->reach_m) {
    warnings.push_back(tools::formatted("positions reach %.3g m from the origin, all parts of the "
                                        "scene lie within %.3g m",
                                        f.farthest_m, scene->reach_m) +
                       fix);
    return;
  } else if (f.farthest_m > kWide_m) {
    warnings.push_back(tools::formatted("positions reach %.3g m from the origin", f.farthest_m) +
                       fix);
    return;
  }
  if (mean > kFastMean_m_per_s) {
    warnings.push_back(tools::formatted("the part goes at %.3g m/s in the mean, %.3g m in %.3g s",
                                        mean, f.way_m, f.duration_s) +
                       fix);
  } else if (f.fastest_m_per_s > kFastest_m_per_s) {
    warnings.push_back(
        tools::formatted("the part goes at %.3g m/s up to line %zu; remove samples "
                         "that jump, or correct unit and times",
                         f.fastest_m_per_s, f.fastest_line));
  }
}

}  // namespace

std::optional<std::string> start_warning(const SceneStart& scene, const MotionSample& first) {
  const StartDistance away = distance_from(scene, first);
  const bool far = away.way_m > scene.radius_m;
  if (!far && away.turn_rad <= kNearTurn_rad) return std::nullopt;
  return tools::formatted(
      "the first pose is %.4g mm and %.3g rad from the scene's "
      "start, the part has a radius of %.4g mm; move the motion "
      "with --place and --turn, or with --start-at",
      1e3 * away.way_m, away.turn_rad, 1e3 * scene.radius_m);
}

LogFigures log_figures(const MotionLog& log) {
  LogFigures f;
  const std::vector<MotionSample>& samples = log.samples;
  f.duration_s = samples.back().t_s;
  f.rate_hz = static_cast<double>(samples.size() - 1) / f.duration_s;
  std::vector<double> steps;
  double low[3], high[3];
  std::copy_n(samples.front().p, 3, low);
  std::copy_n(samples.front().p, 3, high);
  f.farthest_m = norm_of(samples.front().p);
  for (std::size_t k = 1; k < samples.size(); ++k) {
    const double step_s = samples[k].t_s - samples[k - 1].t_s;
    const double step_m = distance(samples[k], samples[k - 1]);
    steps.push_back(step_s);
    if (step_s > f.longest_gap_s * (1 + kSameStep)) {
      f.longest_gap_s = step_s;
      f.gap_line = log.lines[k];
    }
    f.way_m += step_m;
    f.farthest_m = std::max(f.farthest_m, norm_of(samples[k].p));
    if (step_m / step_s > f.fastest_m_per_s) {
      f.fastest_m_per_s = step_m / step_s;
      f.fastest_line = log.lines[k];
    }
    for (std::size_t i = 0; i < 3; ++i) {
      low[i] = std::min(low[i], samples[k].p[i]);
      high[i] = std::max(high[i], samples[k].p[i]);
      f.extent_m = std::max(f.extent_m, high[i] - low[i]);
    }
  }
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  f.median_step_s = *middle;
  return f;
}

SceneStart scene_start(const SceneView& view) {
  SceneStart scene;
  const SceneParameters& parameters = view.parameters();
  const double* q = parameters.start_q_wa_xyzw;
  const double wxyz[4] = {q[3], q[0], q[1], q[2]};
  std::copy_n(wxyz, 4, scene.start.q_wxyz);
  std::copy_n(parameters.start_p_wa_m, 3, scene.start.p);
  std::copy_n(view.bodies()[0].reference_m, 3, scene.grip_m);
  for (const PieceRecord& piece : view.pieces()) {
    const double ball = norm_of(piece.centre_m) + piece.radius_m;
    if (piece.body == 0) {
      scene.radius_m = std::max(scene.radius_m, ball);
    } else {
      scene.reach_m =
          std::max(scene.reach_m, norm_of(view.bodies()[piece.body].reference_m) + ball);
    }
  }
  scene.reach_m = std::max(scene.reach_m, grip_of(scene, scene.start).norm() + scene.radius_m);
  return scene;
}

StartDistance distance_from(const SceneStart& scene, const MotionSample& pose) {
  return {(grip_of(scene, pose) - grip_of(scene, scene.start)).norm(),
          turn_between(pose, scene.start)};
}

std::vector<std::string> log_warnings(const MotionLog& log, const LogFigures& figures,
                                      const std::optional<SceneStart>& scene) {
  std::vector<std::string> warnings;
  judge_unit(log, figures, scene, warnings);
  if (figures.longest_gap_s > kLongGap_s &&
      figures.longest_gap_s > kLongGapSteps * figures.median_step_s) {
    warnings.push_back(tools::formatted(
        "no sample for %.4g s before line %zu; the part goes straight through the gap",
        figures.longest_gap_s, figures.gap_line));
  }
  return warnings;
}

void require_near(const MotionLog& log, const LogFigures& figures) {
  if (figures.farthest_m <= kFarthestLog_m) return;
  throw tools::InputError(
      log.path + ": positions reach " + tools::short_number(figures.farthest_m, 4) +
      " m from the origin, a motion at most " + tools::short_number(kFarthestLog_m, 3) + " m; " +
      (log.columns.unit_m == 1 ? "where these are millimetres, say --unit mm; else " : "") +
      "move them with --place X,Y,Z or --start-at SCENE.rtscene");
}

}  // namespace haptic::sim
