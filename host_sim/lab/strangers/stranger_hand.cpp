// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/strangers/stranger_hand.hpp"

#include <algorithm>
#include <cmath>

namespace haptic::sim {
namespace {

constexpr double kSearchDepth_mm = 0.8, kWobble_mm = 0.4, kAway_mm = 50;

/// Way points one after another.
class Way {
 public:
  explicit Way(const StrangerPair& pair) : pair_(pair), at_(pair.start()) {
    script_.tremor.position_m = 1e-4;
    script_.tremor.angle_rad = 1e-3;
    script_.seed = pair.seed;
    add("start", 0);
  }
  void to(double seconds, const std::string& phase, const WayPose& pose) {
    time_s_ += seconds;
    at_ = pose;
    add(phase, 1);
  }
  /// The tremor ends.
  void rest(double seconds, const std::string& phase) {
    time_s_ += seconds;
    add(phase, 0);
  }
  [[nodiscard]] const WayPose& at() const { return at_; }
  [[nodiscard]] const MotionScript& script() const { return script_; }

 private:
  void add(const std::string& phase, double tremor) {
    const MotionSample sample = pair_.pose(at_, time_s_);
    WayPoint point;
    point.phase = phase;
    point.t_s = time_s_;
    std::ranges::copy(sample.p, point.p);
    std::ranges::copy(sample.q_wxyz, point.q_wxyz);
    point.tremor = tremor;
    script_.waypoints.push_back(point);
  }

  const StrangerPair& pair_;
  MotionScript script_;
  WayPose at_;
  double time_s_ = 0;
};

HandMotion with_stops(const MotionScript& script) {
  HandMotion motion;
  const auto add = [&](MotionSample sample, const std::string& phase) {
    sample.t_s = 1e-3 * static_cast<double>(motion.samples.size());
    motion.samples.push_back(sample);
    motion.phases.push_back(phase);
  };
  for (const MotionSample& sample : make_motion(script)) {
    const std::string& phase = phase_at(script, sample.t_s);
    add(sample, phase);
    if (motion.samples.size() % (kTicksBetweenStops + kTicksOfStop) != kTicksBetweenStops) continue;
    motion.stops.push_back(motion.samples.size());
    for (std::size_t k = 0; k < kTicksOfStop; ++k) add(sample, phase);
  }
  return motion;
}

}  // namespace

HandMotion insertion_motion(const StrangerPair& pair) {
  Way way(pair);
  way.rest(0.1, "rest");
  for (const WayPose& pose : pair.detour) way.to(0.35, "slide", pose);
  WayPose pose = pair.start();
  pose.to_go_mm = pair.depth_mm - kSearchDepth_mm;
  pose.across_mm[0] = pair.beside_mm;
  pose.tilt_rad[1] = pair.beside_rad;
  way.to(0.5, "approach", pose);
  constexpr double kSearch[5][2] = {{0, 1}, {-1, 0}, {0, -1}, {0.3, 0}, {0, 0}};
  for (int k = 0; k < 5; ++k) {
    for (int i = 0; i < 2; ++i) pose.across_mm[i] = pair.beside_mm * kSearch[k][i];
    pose.tilt_rad[1] = pair.beside_rad * (1 - 0.25 * k);
    way.to(0.12, "search", pose);
  }
  pose = WayPose{};
  pose.turn_rad = pair.turn_rad;
  if (!pair.turns.empty()) pose.to_go_mm = pair.turns.front().to_go_mm;
  way.to(0.9, "insert", pose);
  const auto turn_to = [&](const WayPose& next, const char* phase) {
    way.to(std::max(0.3, std::abs(next.turn_rad - way.at().turn_rad) / 4), phase, next);
  };
  for (const WayPose& next : pair.turns) turn_to(next, "turn");
  pose = WayPose{};
  pose.to_go_mm = -pair.beyond_mm;
  way.to(0.25, "press", pose);
  constexpr double kSides[4][2] = {{1, 0}, {0, 1}, {-1, 0}, {0, 0}};
  for (const auto& side : kSides) {
    for (int i = 0; i < 2; ++i) {
      pose.across_mm[i] = kWobble_mm * side[i];
      pose.tilt_rad[i] = pair.beside_rad * side[i];
    }
    way.to(0.12, "wobble", pose);
  }
  way.to(0.2, "let go", WayPose{});
  for (auto next = pair.turns.rbegin(); next != pair.turns.rend(); ++next)
    turn_to(*next, "turn back");
  if (!pair.turns.empty()) {
    pose = pair.turns.front();
    pose.turn_rad = pair.turn_rad;
    turn_to(pose, "turn back");
  }
  way.to(0.6, "out", pair.start());
  way.rest(0.1, "rest");
  return with_stops(way.script());
}

HandMotion open_air_motion(const StrangerPair& pair) {
  Way way(pair);
  WayPose pose = pair.start();
  pose.to_go_mm += kAway_mm;
  way.to(0.5, "away", pose);
  WayPose beside = pose;
  beside.across_mm[0] = 5;
  beside.tilt_rad[0] = 0.2;
  way.to(0.3, "round", beside);
  way.to(0.3, "round", pose);
  way.to(0.5, "back", pair.start());
  way.rest(0.1, "rest");
  return with_stops(way.script());
}

}  // namespace haptic::sim
