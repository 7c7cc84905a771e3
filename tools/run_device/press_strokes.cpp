// SPDX-License-Identifier: Apache-2.0
#include "tools/run_device/press_strokes.hpp"

#include <algorithm>
#include <cstdint>
#include <functional>

#include "rt_core/servo_tick.hpp"
#include "tools/run_device/core_in_memory.hpp"
#include "tools/verdict/session_judge.hpp"

namespace haptic::tools {
namespace {

constexpr double kUsual_m = 0.03, kPress_m = 0.01, kFarthest_m = 0.3, kStep_m = 5.0e-4;

/// @param touches_at  a part touches, so far on the way; asked in order.
double stroke_m(const std::function<bool(double way_m)>& touches_at) {
  for (double way_m = 0; way_m <= kFarthest_m; way_m += kStep_m)
    if (touches_at(way_m)) return std::max(kUsual_m, way_m + kPress_m);
  return kUsual_m;
}

/// A handle on its way, as the core is given it.
struct Way {
  WorkspaceMap map;
  Vec3 direction_d;

  [[nodiscard]] StepInput at(double way_m, std::uint64_t tick) const {
    Pose handle_dh;
    handle_dh.p_wa = direction_d * static_cast<Real>(way_m);
    StepInput input;
    input.sequence = tick;
    input.pose_wa = mesh_pose(map, handle_dh);
    return input;
  }
  [[nodiscard]] std::array<double, 3> stroke(double way_m) const {
    std::array<double, 3> along{};
    for (int k = 0; k < 3; ++k)
      along[static_cast<std::size_t>(k)] = way_m * static_cast<double>(direction_d[k]);
    return along;
  }
};

WorkspaceMap map_at_start(const HandDevice& device, const SceneView& scene) {
  const ServoParameters parameters = with_scene(device.servo, scene);
  return begun_map(parameters.map, parameters.start, Pose{});
}

Vec3 grip_w(const WorkspaceMap& map) {
  const Pose start = mesh_pose(map, Pose{});
  return start.p_wa + start.q_wa * map.grip_a;
}

std::vector<std::array<double, 3>> strokes_of_two(const DeviceConfig& config, Hands& hands) {
  std::array<Way, kMostHands> ways;
  for (std::uint32_t k = 0; k < kMostHands; ++k)
    ways[k].map = map_at_start(config.devices[k], hands.hand(k).scene());
  const Vec3 apart_w = grip_w(ways[1].map) - grip_w(ways[0].map);
  const Real distance_m = apart_w.norm();
  const Vec3 together_w = distance_m > 0 ? Vec3(apart_w / distance_m) : Vec3(0, 0, -1);
  for (std::size_t k = 0; k < kMostHands; ++k)
    ways[k].direction_d = ways[k].map.q_wd.conjugate() * (k == 0 ? together_w : Vec3(-together_w));
  const LawId law = hands.hand(0).scene().parameters().law;
  std::uint64_t tick = 0;
  const double way_m = stroke_m([&](double way) {
    ++tick;
    const std::array<StepInput, kMostHands> inputs{ways[0].at(way, tick), ways[1].at(way, tick)};
    const Hands::Each<StepResult> results = hands.step({&inputs[0], &inputs[1]});
    return felt_part_touches(results[0], law) || felt_part_touches(results[1], law);
  });
  return {ways[0].stroke(way_m), ways[1].stroke(way_m)};
}

}  // namespace

std::vector<std::array<double, 3>> press_strokes_m(const DeviceConfig& config,
                                                   const SceneBytes& scene) {
  const Vec3 down(0, 0, -1);
  CoreInMemory own;
  // It was opened before: read_usable_scene.
  if (own.open(scene.span()) != RtStatus::kOk) return {{0, 0, -kUsual_m}};
  if (own.parts != nullptr) return strokes_of_two(config, own.parts->hands);
  const Way way{map_at_start(config.devices[0], own.view), down};
  const LawId law = own.view.parameters().law;
  const auto touches_at = [&](double way_m) {
    StepInput input = way.at(way_m, 0);
    return felt_part_touches(own.core->step(input), law);
  };
  return {way.stroke(stroke_m(touches_at))};
}

}  // namespace haptic::tools
