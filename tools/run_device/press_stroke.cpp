// SPDX-License-Identifier: Apache-2.0
#include "tools/run_device/press_stroke.hpp"

#include <algorithm>

#include "tools/run_device/core_in_memory.hpp"
#include "tools/verdict/session_judge.hpp"

namespace haptic::tools {
namespace {

constexpr double kUsual_m = 0.03, kPress_m = 0.01, kFarthest_m = 0.3, kStep_m = 5.0e-4;

}  // namespace

double press_stroke_m(const DeviceConfig& config, const SceneBytes& scene) {
  CoreInMemory own;
  if (own.open(scene.span()) != RtStatus::kOk) return kUsual_m;
  const ServoParameters parameters = with_scene(config.servo, own.view);
  const WorkspaceMap map = begun_map(parameters.map, parameters.start, Pose{});
  const LawId law = own.view.parameters().law;
  Pose handle_dh;
  for (double down_m = 0; down_m <= kFarthest_m; down_m += kStep_m) {
    handle_dh.p_wa.z() = static_cast<Real>(-down_m);
    StepInput input;
    input.pose_wa = mesh_pose(map, handle_dh);
    if (felt_part_touches(own.core->step(input), law)) return std::max(kUsual_m, down_m + kPress_m);
  }
  return kUsual_m;
}

}  // namespace haptic::tools
