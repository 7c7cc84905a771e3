// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The tick as the device sees it: its newest state in, a command that is safe to send out. Nothing
/// that the core renders reaches a device by any other way.
///
///     state -> checks -> workspace map -> HapticCore::step -> wrench at the handle
///           -> arming -> output limiter -> command, trace

#include <cstdint>

#include "rt_core/base/workspace_map.hpp"
#include "rt_core/exchange/device_exchange.hpp"
#include "rt_core/exchange/step_trace.hpp"
#include "rt_core/haptic_core.hpp"
#include "rt_core/safety/arming.hpp"
#include "rt_core/safety/output_limiter.hpp"

namespace haptic {

/// Which switches of the device mean what, as masks; 0: none does. Deadman held = armed; the clutch
/// only indexes and never arms.
struct SwitchMap {
  std::uint32_t deadman = 1u << 0;
  std::uint32_t clutch = 1u << 1;
  std::uint32_t emergency_stop = 0;
};

/// Where the part may go; outside the wrench is ramped out and a fault latched. A limit of 0: none.
struct MotionEnvelope {
  Vec3 centre_w = Vec3::Zero();
  Vec3 half_extent_m = Vec3::Zero();  ///< of the box that the grip point stays in, W axes
  Quat q_wa = Quat::Identity();       ///< middle of the orientations
  Real max_angle_rad = 0;             ///< largest turn from it
};

struct ServoParameters {
  WorkspaceMap map;
  SafetyLimits limits;
  SwitchMap switches;
  MotionEnvelope envelope;
};

/// What a tick is given beside the device's state.
struct ServoInput {
  DeviceState state;               ///< the newest there is; the same again when none is newer
  std::int64_t now_ns = 0;         ///< host monotonic clock, at the begin of the tick
  std::uint32_t late_periods = 0;  ///< whole periods that the loop missed before this tick
  bool emergency_stop = false;     ///< the call beside the device's own input; latches
};

struct ServoResult {
  DeviceCommand command;
  StepResult rendered;
  ArmingState arming = ArmingState::kDisarmed;
  std::uint32_t faults = 0;         ///< SafetyFault, latched
  std::uint32_t limiter_flags = 0;  ///< LimiterFlag
  bool rendered_new = false;        ///< a new state was rendered; else the last wrench was kept
};

/// Owner: the servo thread; the core and the recorder outlive it. No heap, lock or system call;
/// cost: the core's tick and a constant. Same inputs, same bits.
class ServoTick {
 public:
  ServoTick(HapticCore& core, const ServoParameters& parameters, const SceneCapacity& bounds,
            FlightRecorder* recorder) noexcept;

  [[nodiscard]] ServoResult step(const ServoInput& input) noexcept;

 private:
  [[nodiscard]] std::uint32_t check_state(const ServoInput& input, bool is_new) noexcept;
  [[nodiscard]] std::uint32_t render(const ServoInput& input, ServoResult& result) noexcept;

  HapticCore& core_;
  ServoParameters parameters_;
  SceneCapacity bounds_;
  FlightRecorder* recorder_;
  Arming arming_;
  OutputLimiter limiter_;
  StepResult last_rendered_;
  DeviceState last_state_;
  std::uint64_t tick_ = 0;
};

}  // namespace haptic
