// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/studies/realtime/pressed_scene.hpp"

#include "host_sim/device/pressing_script.hpp"
#include "host_sim/device/stack_run.hpp"

namespace haptic::sim {
namespace {

// Of the pressing script: between its second and third station the hand rests.
constexpr double kRestShare = 0.5;

}  // namespace

PressedScene pressed_scene(CoreSession& session, double rate_hz, double seconds) {
  PressedScene scene;
  const SceneParameters& parameters = session.view().parameters();
  scene.stack = stack_over(StackCarrier::kUsb, device_of(parameters, rate_hz), parameters.device,
                           *hand_named("firm"), rate_hz);
  scene.hand =
      scripted_hand(session, make_motion(pressing_script(session, rate_hz, seconds)), rate_hz);
  scene.rest_s = kRestShare * seconds;
  return scene;
}

}  // namespace haptic::sim
