// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Last stage of a tick: from the law's wrench to the output, by ramps and passivity; and the
/// estimate of the device's twist.

#include <cstdint>
#include <span>

#include "rt_core/base/arena.hpp"
#include "rt_core/base/encoder_play.hpp"
#include "rt_core/base/twist_estimator.hpp"
#include "rt_core/safety/passivity.hpp"
#include "rt_core/safety/wrench_ramp.hpp"
#include "rt_core/scene/scene_traits.hpp"
#include "rt_core/scene/scene_view.hpp"
#include "rt_core/tick/step.hpp"

namespace haptic {

/// The law's wrench, the part of it that is the spring's pull, and the energy that this part is
/// the gradient of; `stores` is false of laws without one.
struct LawWrench {
  Wrench wrench_w, spring_w;
  StoredEnergy stored;
  double given_j = 0;  ///< of it, what other parts that move have given in this tick, less what
                       ///< went to them
  bool stores = false;
};

/// How the device moves: its pose after play, and its velocity over an adaptive window of that; and
/// the wrench that moves it.
struct DeviceMotion {
  PlayedPose played;
  TwistEstimate twist;
  Wrench accepted_w;  ///< that of the input; without the guide's share where there is a guide
};

struct Output {
  Wrench wrench_w, spring_w;  ///< as in StepResult
  Twist device_twist_w;
  Real energy_j = 0;
  std::uint32_t flags = 0;  ///< kFlagRamping, kFlagPassivity
};

class OutputStage {
 public:
  void place(Arena& arena, const SceneView& scene) noexcept;
  void read_scene(const SceneView& scene) noexcept;
  void reset() noexcept;
  /// The device's motion with this report, for the law and for finish. Once a tick.
  [[nodiscard]] DeviceMotion sense(const GripPose& device, const StepInput& input) noexcept;
  /// `flags`: of the stages before; those that ask for a ramp out do so. Once a tick.
  [[nodiscard]] Output finish(const LawWrench& law, const DeviceMotion& device,
                              const StepInput& input, std::uint32_t flags) noexcept;

 private:
  /// Time of this report; without stamps ticks are a period apart.
  [[nodiscard]] std::int64_t stamp_of(const StepInput& input) const noexcept;
  /// True if the device is taken for one of three degrees of freedom: a part that never turns has
  /// no torque under law proxy; the other laws report it.
  [[nodiscard]] bool device_translates() const noexcept {
    return kSceneTraits.is_locked(locked_) && kSceneTraits.is_law(law_, LawId::kProxy);
  }

  std::int64_t period_ns_ = 0;
  std::int64_t stamp_ns_ = 0;  ///< of the last report
  bool has_stamp_ = false;     ///< there was one since the last reset
  bool observes_ = false;      ///< the passivity layer acts
  bool locked_ = false;
  LawId law_ = LawId::kProxy;
  EncoderPlay play_;
  Passivity passivity_;
  WrenchRamp ramp_;
  std::span<TwistEstimator> twist_;  ///< one where the scene needs a velocity, else none
};

}  // namespace haptic
