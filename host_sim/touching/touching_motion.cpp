// SPDX-License-Identifier: Apache-2.0
#include "host_sim/touching/touching_motion.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "host_sim/session/motion_csv.hpp"
#include "tools/common/formatted.hpp"
#include "tools/plan/plan_limits.hpp"

namespace haptic::sim {
namespace {

constexpr double kLongestWay_m = 2.0;
constexpr std::size_t kMostNearestWays = 8;

/// A way to a touch.
struct Approach {
  std::vector<tools::PlanPose> way_in;
  HeldPart from;  ///< where the straight way begins
  Vector along_w = Vector::Zero();
  double way_m = 0;
};

/// The longest straight way: a part that is farther off was given in another unit, or elsewhere.
double longest_way_m(const SceneView& view) {
  Vector low = Vector::Constant(1e30), high = -low;
  for (std::uint32_t k = view.bodies()[0].piece_count; k < view.pieces().size(); ++k) {
    const PieceRecord& piece = view.pieces()[k];
    const double* const reference = view.bodies()[piece.body].reference_m;
    const Vector centre(reference[0] + piece.centre_m[0], reference[1] + piece.centre_m[1],
                        reference[2] + piece.centre_m[2]);
    low = low.cwiseMin(centre - Vector::Constant(piece.radius_m));
    high = high.cwiseMax(centre + Vector::Constant(piece.radius_m));
  }
  return std::max(kLongestWay_m, (high - low).norm() + 2 * held_at_start(view).radius_m);
}

/// True if a player takes all places of the straight way and of the press beyond it.
bool is_played(const HeldPart& from, const Vector& along_w, double way_m) {
  const Vector mesh_w = from.grip_w - from.q_wa * from.grip_a;
  const double reach_m = way_m + from.radius_m;
  return std::max(mesh_w.norm(), (mesh_w + reach_m * along_w).norm()) <= kFarthestMotion_m;
}

class Script {
 public:
  explicit Script(const HeldPart& held) : held_(held) {}

  /// To a place of the grip point, there at rest.
  void go(const char* phase, double seconds, const Vector& grip_w, const Rotation& q_wa) {
    t_s_ += seconds;
    const MotionSample sample = sample_at(t_s_, grip_w - q_wa * held_.grip_a, q_wa);
    WayPoint point;
    point.phase = phase;
    point.t_s = t_s_;
    std::copy(sample.p, sample.p + 3, point.p);
    std::copy(sample.q_wxyz, sample.q_wxyz + 4, point.q_wxyz);
    script_.waypoints.push_back(point);
  }

  /// Along poses, from the first of them, where the part is.
  void follow(const char* phase, const std::vector<tools::PlanPose>& poses) {
    constexpr double kSpeed_m_per_s = 0.06, kLongest_s = 20, kLeastLeg_s = 0.02, kMostTurn_rad = 2;
    double way_m = 0;
    for (std::size_t k = 1; k < poses.size(); ++k)
      way_m += tools::step_length_m(poses[k - 1], poses[k], held_.radius_m);
    const double speed = std::max(kSpeed_m_per_s, way_m / kLongest_s);
    for (std::size_t k = 1; k < poses.size(); ++k) {
      const tools::PlanPose &from = poses[k - 1], &to = poses[k];
      const double seconds =
          std::max(kLeastLeg_s, tools::step_length_m(from, to, held_.radius_m) / speed);
      const int parts = tools::turn_between(from, to).norm() > kMostTurn_rad ? 2 : 1;
      for (int part = 1; part <= parts; ++part) {
        const tools::PlanPose pose = tools::between(from, to, static_cast<double>(part) / parts);
        go(phase, seconds / parts, tools::place_of(pose), tools::turn_of(pose));
      }
    }
  }

  [[nodiscard]] MotionScript take() { return std::move(script_); }

 private:
  const HeldPart& held_;
  double t_s_ = 0;
  MotionScript script_;
};

TouchingScript script_of(const SceneView& view, const Approach& approach) {
  constexpr double kPressForce_n = 3.0, kLeastPress_m = 2.0e-4, kPress_m = 0.003, kSlide_m = 0.005;
  constexpr double kTilt_rad = 0.03, kApproachSpeed_m_per_s = 0.06, kLongestApproach_s = 20;
  const HeldPart& held = approach.from;
  TouchingScript touching;
  touching.way_in = approach.way_in;
  touching.along_w = approach.along_w;
  touching.way_m = approach.way_m;
  const double third_m = held.radius_m / 3;
  touching.press_m = std::min(
      {std::max(kLeastPress_m, kPressForce_n / view.parameters().k_f_n_per_m), kPress_m, third_m});
  touching.slide_m = std::min(kSlide_m, third_m);
  touching.tilt_rad = kTilt_rad;

  const Vector along = touching.along_w, u = along.unitOrthogonal(), v = along.cross(u);
  const Vector touch = held.grip_w + touching.way_m * along;
  const Vector pressed = touch + touching.press_m * along;
  const double travel_s =
      std::clamp(touching.way_m / kApproachSpeed_m_per_s, 1.0, kLongestApproach_s);
  const Rotation q = held.q_wa, tilted = Rotation(Eigen::AngleAxisd(touching.tilt_rad, u)) * q;
  const Vector to_u = touching.slide_m * u, to_v = touching.slide_m * v;
  const HeldPart at_start = held_at_start(view);
  Script script(held);
  script.go("start", 0, at_start.grip_w, at_start.q_wa);
  script.follow("way in", touching.way_in);
  script.go("approach", travel_s, touch, q);
  script.go("press", 0.6, pressed, q);
  script.go("rest", 0.4, pressed, q);
  script.go("slide", 0.8, pressed + to_u, q);
  script.go("slide", 1.2, pressed - to_u, q);
  script.go("slide", 1.0, pressed + to_v, q);
  script.go("slide", 1.2, pressed - to_v, q);
  script.go("centre", 0.8, pressed, q);
  script.go("tilt", 0.6, pressed, tilted);
  script.go("level", 0.6, pressed, q);
  script.go("lift", 0.6, touch, q);
  script.go("leave", travel_s, held.grip_w, q);
  script.follow("leave", {touching.way_in.rbegin(), touching.way_in.rend()});
  touching.script = script.take();
  return touching;
}

/// Looks for touches on straight ways, and plays motions to them.
class Search {
 public:
  Search(CoreSession& session, const TouchingOptions& options)
      : session_(session),
        options_(options),
        start_(held_at_start(session.view())),
        longest_m_(longest_way_m(session.view())) {}

  [[nodiscard]] TouchingMotion run() {
    if (!is_played(start_, Vector::Zero(), 0)) {
      best_.not_touched = tools::formatted(
          "the part starts %.3g m from the origin, and a motion is played to %.3g m from it; give "
          "[moving] position_m in metres, and scale_to_m the metres per unit of the mesh",
          static_cast<double>(start_.mesh_pose().p_wa.norm()), kFarthestMotion_m);
      return std::move(best_);
    }
    if (by_way_in() || by_axes() || by_nearest_places()) return std::move(best_);
    if (!best_.motion.empty()) return std::move(best_);  // touches, if seldom
    best_.not_touched = reason();
    return std::move(best_);
  }

 private:
  void say(const std::string& text) const {
    if (options_.progress) options_.progress(text);
  }

  /// The touch on the straight way from `from`, if a motion can be made of it.
  std::optional<Approach> approach(const HeldPart& from, const Vector& along_w) {
    best_.tried += 1;
    say("looking for a touch, way " + std::to_string(best_.tried));
    const WayToTouch way = way_to_touch(session_, from, along_w);
    held_back_ += way.held_back ? 1 : 0;
    why_not_ |= way.why_not;
    const std::optional<double> way_m = way.length_m;
    if (!way_m) return std::nullopt;
    if (*way_m > longest_m_ || !is_played(from, along_w, *way_m)) {
      if (!too_far_m_ || *way_m < *too_far_m_) too_far_m_ = way_m;
      return std::nullopt;
    }
    return Approach{{}, from, along_w, *way_m};
  }

  /// True if the motion, played once, touches; the best one is kept.
  bool touches(const Approach& approach) {
    TouchingScript touching = script_of(session_.view(), approach);
    // As a file has it: what is said of the motion is so in a replay of the file.
    std::vector<MotionSample> motion = as_written(make_motion(touching.script));
    say(tools::formatted("playing a motion of %zu ticks", motion.size()));
    ReplayOptions options;
    options.expects_contact = true;
    options.progress = options_.shows_ticks;
    ReplayResult played = replay(session_, motion, options);
    const auto in_contact = static_cast<std::size_t>(
        std::ranges::count_if(played.ticks, [](const TickRecord& t) { return t.in_contact; }));
    const bool enough = static_cast<double>(in_contact) >=
                        kLeastTouchedShare * static_cast<double>(played.ticks.size());
    played_ += 1;
    if (in_contact > best_contact_) {
      best_contact_ = in_contact;
      best_.touching = std::move(touching);
      best_.motion = std::move(motion);
      best_.played = std::move(played);
    }
    session_.core().reset();
    return enough;
  }

  bool by_way_in() {
    if (!options_.find_way_in) return false;
    const WayIn way = options_.find_way_in(session_, options_.way_in,
                                           [this](const std::string& text) { say(text); });
    best_.no_way_in = way.not_found;
    if (way.corners.empty()) return false;
    const HeldPart goal = held_at(session_.view(), way.corners.back());
    const tools::PlanPose& before = way.corners[way.corners.size() - 2];
    const Vector last = goal.grip_w - tools::place_of(before);
    // A way without a corner goes straight on from the start to the touch.
    if (way.corners.size() == 2 && tools::turn_between(before, way.corners.back()).norm() == 0) {
      const std::optional<Approach> straight = approach(start_, last.normalized());
      return straight && touches(*straight);
    }
    std::vector<Vector> ways;
    if (last.norm() > 1e-3 * goal.radius_m) ways.push_back(last.normalized());
    for (const int axis : {2, 0, 1}) {
      ways.push_back(-Vector::Unit(axis));
      ways.push_back(Vector::Unit(axis));
    }
    std::optional<Approach> soonest;
    for (const Vector& along_w : ways) {
      std::optional<Approach> found = approach(goal, along_w);
      if (!found || (soonest && found->way_m >= soonest->way_m)) continue;
      soonest = std::move(found);
      if (along_w == ways.front() && soonest->way_m < goal.radius_m) break;
    }
    if (!soonest) return false;
    soonest->way_in = way.corners;
    return touches(*soonest);
  }

  bool by_axes() {
    std::vector<Approach> found;
    for (const int axis : {2, 0, 1}) {
      for (const double sign : {-1.0, 1.0}) {
        if (auto one = approach(start_, sign * Vector::Unit(axis))) found.push_back(*one);
      }
    }
    std::ranges::stable_sort(found, {}, &Approach::way_m);
    return std::ranges::any_of(found, [this](const Approach& one) { return touches(one); });
  }

  bool by_nearest_places() {
    const auto ways = ways_to_nearest(session_.view(), start_, kMostNearestWays);
    return std::ranges::any_of(ways, [this](const Vector& along_w) {
      const std::optional<Approach> found = approach(start_, along_w);
      return found && touches(*found);
    });
  }

  [[nodiscard]] std::string reason() const {
    if (played_ > 0) {
      return tools::formatted(
          "each of %zu motions that were made and played touches nothing: give [moving] position_m "
          "a place beside the fixed parts, or [budget] a larger near_pairs and work_units",
          played_);
    }
    if (too_far_m_) {
      return tools::formatted(
          "the part starts %s m away from the first touch, more than is played; give [moving] "
          "position_m in metres, and scale_to_m the metres per unit of the mesh",
          tools::short_number(*too_far_m_, 3).c_str());
    }
    std::string text = tools::formatted(
        "the part meets no fixed part on %zu straight ways, along the axes and to the nearest "
        "places",
        best_.tried);
    if (held_back_ > 0) {
      text += tools::formatted("; on %zu of them it stays behind the hand", held_back_);
      if (has(tools::WhyNot::kListFull)) {
        return text +
               ", as more pairs of pieces are near than [budget] near_pairs: parts of fewer "
               "pieces help (tolerance_m), or a larger near_pairs and work_units";
      }
      if (has(tools::WhyNot::kBehind)) return text + ": a larger [budget] work_units helps";
    }
    if (tools::PlanLimits(session_.view().parameters().envelope).has_box())
      return text + ", within [motion_limits] workspace: widen it, or move the fixed parts";
    return text +
           "; give [moving] position_m a place beside them, or write way points "
           "(MOTION.md)";
  }

  [[nodiscard]] bool has(tools::WhyNot why) const {
    return (why_not_ >> static_cast<unsigned>(why) & 1u) != 0;
  }

  CoreSession& session_;
  const TouchingOptions& options_;
  const HeldPart start_;
  const double longest_m_;
  TouchingMotion best_;
  std::size_t best_contact_ = 0, played_ = 0;
  std::size_t held_back_ = 0;  ///< ways
  std::uint32_t why_not_ = 0;  ///< of these: tools::WhyNot, a bit each
  std::optional<double> too_far_m_;
};

}  // namespace

TouchingMotion touching_motion(CoreSession& session, const TouchingOptions& options) {
  return Search(session, options).run();
}

std::string way_text(const Vector& along_w) {
  constexpr const char* kAxes[] = {"x", "y", "z"};
  for (int k = 0; k < 3; ++k) {
    if (std::abs(along_w[k]) == 1.0) return (along_w[k] > 0 ? "+" : "-") + std::string(kAxes[k]);
  }
  return tools::formatted("(%.3g, %.3g, %.3g)", along_w.x(), along_w.y(), along_w.z());
}

}  // namespace haptic::sim
