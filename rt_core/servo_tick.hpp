// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The tick as the device sees it: its newest state in, a command that is safe to send out. Nothing
/// that the core renders reaches a device by any other way.
///
///     state -> checks -> workspace map -> moving frame -> HapticCore::step -> wrench at the handle
///           -> arming -> output limiter -> command, trace

#include <cstdint>
#include <span>

#include "rt_core/base/motion_envelope.hpp"
#include "rt_core/base/workspace_map.hpp"
#include "rt_core/exchange/device_exchange.hpp"
#include "rt_core/exchange/step_trace.hpp"
#include "rt_core/haptic_core.hpp"
#include "rt_core/part_hand.hpp"
#include "rt_core/safety/arming.hpp"
#include "rt_core/safety/moving_frame.hpp"
#include "rt_core/safety/output_limiter.hpp"

namespace haptic {

/// Which switches of the device mean what, as masks; 0: none does. Deadman held = armed; the clutch
/// only indexes and never arms. The deadman is held when all of its switches are, the others when
/// any is.
struct SwitchMap {
  std::uint32_t deadman = 1u << 0;
  std::uint32_t clutch = 1u << 1;
  std::uint32_t emergency_stop = 0;
};

/// Where the part begins, and begins again after each fault: by default where the map has the
/// device's pose.
struct StartPlace {
  bool place = false;  ///< at `pose_wa` wherever the handle stands: offset_w of the map is found
  bool turn = false;   ///< turned as there however the handle is: q_ha of the map is found
  Pose pose_wa;        ///< of A's mesh frame in W; unit to 1e-3
};

struct ServoParameters {
  WorkspaceMap map;
  StartPlace start;
  SafetyLimits limits;
  SwitchMap switches;
  /// Outside, or about to be there by the next tick if the part goes on as in the last, the wrench
  /// is ramped out and a fault latched. Limits of place or turn are the scene's: the
  /// core watches it, and this is not looked at.
  MotionEnvelope envelope;
};

/// With the grip point and the start pose of the scene.
[[nodiscard]] ServoParameters with_scene(ServoParameters parameters,
                                         const SceneView& scene) noexcept;

/// What a tick is given in addition to the device's state.
struct ServoInput {
  DeviceState state;                 ///< the newest there is; the same again when none is newer
  std::int64_t now_ns = 0;           ///< host monotonic clock, at the begin of the tick
  std::uint32_t late_periods = 0;    ///< whole periods that the loop missed before this tick
  bool emergency_stop = false;       ///< the call in addition to the device's own input; latches
  bool report_goal_contact = false;  ///< as in StepInput; else the trace's d_near_m is kNotSearched
  FrameRecord frame;  ///< of the fixed parts, the newest; number 0: none yet, they stand in W
  std::span<const FrameRecord> driven;  ///< the newest of driven parts (DrivenInput)
  /// For two hands with a device each (two_hand_tick.hpp): the other exerts a force, or is about
  /// to; and the driven parts have followed their streams before.
  bool other_is_felt = false, has_followed = false;
  std::uint32_t other_faults = 0;  ///< SafetyFault that the other had in the last tick
};

struct ServoResult {
  DeviceCommand command;
  StepResult rendered;  ///< in the frame of the fixed parts
  Pose frame_wf;        ///< of that frame in W
  ArmingState arming = ArmingState::kDisarmed;
  std::uint32_t faults = 0;         ///< SafetyFault, latched
  std::uint32_t limiter_flags = 0;  ///< LimiterFlag
  bool rendered_new = false;        ///< a new state was rendered; else the last wrench was kept
  bool began = false;               ///< and the core was reset before it: the part begins there
  std::uint32_t present = 0;        ///< SafetyFault: causes that are there now
  std::uint32_t waits = 0;  ///< ArmingWait: why it does not arm now; 0: it is armed, or arming
};

/// The map of a tick in which the part begins: `start` with the handle at `handle_dh`.
[[nodiscard]] WorkspaceMap begun_map(WorkspaceMap map, const StartPlace& start,
                                     const Pose& handle_dh) noexcept;

/// What the core is given for a new state of the device, in the frame W. `arm_d`: handle_arm at the
/// state's orientation; `sent_d`: the last command, which counts as accepted by a device that does
/// not say what it was handed.
[[nodiscard]] StepInput core_input(const DeviceState& state, const ServoParameters& parameters,
                                   const Vec3& arm_d, const Wrench& sent_d) noexcept;

/// A pose may differ from the last by this much after any time: stamps jitter, encoders
/// have steps.
inline constexpr Real kJumpFloor_m = 2.0e-3_r, kJumpFloor_rad = 0.05_r;
/// After this long without a state the hand can be anywhere: no jump is looked for.
inline constexpr std::int64_t kLongAbsence_ns = 100'000'000;
/// A wrench is held between two reports that are at most this far apart; slower ones are late.
inline constexpr std::int64_t kLongestReportPeriod_ns = 20'000'000;

/// Owner: the servo thread; the core and the recorder outlive it. No heap, lock or system call;
/// cost: the core's tick and a constant. Same inputs, same bits.
///
/// The core follows the device whenever its pose can be used, armed or not, so that the picture is
/// true and the proxy stays outside obstacles while the hand is free. Its history is dropped
/// (reset, with the offsets of clutch and anchor) where the poses before and after do not belong
/// together: after the link or the calibration was lost, a long absence, a jump, states out of
/// order, a pose that was none; and at an arming where the proxy's pull would be beyond the
/// output's limits or the goal is out of its reach. A part that is then inside an obstacle is
/// brought out without force (kFlagRecovery), and the core ramps its wrench in after that.
///
/// With StartPlace the map is found at each such reset, from the first pose that can be used after
/// it: the part begins where the scene has it start, and the handle leads it from there. Every
/// arming after a fault begins so, too; an envelope that was left needs no way back then.
///
/// The core works in the frame of the fixed parts, wherever its owner moves it (MovingFrame): the
/// proxy and its certificate are the same as if they stood still and the hand moved. Limits of
/// place and turn are in that frame; those of force and torque, and jumps, in the device's. Driven
/// parts are given in it; a lost one releases the hand where it touches the part that is held.
///
/// Each of two hands has one of these. While the other is felt a part follows its handle only where
/// that is armed: else it stays where it is, for whoever leads it would not feel what it pushes.
///
/// The limits are the parameters' own and, from the first state of a connection on, those that came
/// with it, the tighter of each (`tighter`). A state is late by its age in periods of the loop or
/// of the device's stated reports, the longer of the two: between two reports the wrench is held.
class ServoTick {
 public:
  /// A map, start or envelope that is not usable is kFaultInternal in every tick: nothing ever
  /// arms. `recorder` may be nullptr.
  ServoTick(HapticCore& core, const ServoParameters& parameters, const SceneCapacity& bounds,
            FlightRecorder* recorder) noexcept;
  /// For a hand that holds one part after another; the bounds are those of the scene of the part
  /// that is held. `hand` has begun, and outlives this.
  ServoTick(PartHand& hand, const ServoParameters& parameters, FlightRecorder* recorder) noexcept;

  [[nodiscard]] ServoResult step(const ServoInput& input) noexcept;

  /// The two halves of a step, for a hand whose core is stepped together with that of another
  /// (two_hand_tick.hpp).
  struct Opened {
    ServoResult result;
    StepInput to_core;
    std::uint32_t present = 0;  ///< SafetyFault
    bool renders = false;       ///< to_core is to be stepped
  };
  [[nodiscard]] Opened open(const ServoInput& input) noexcept;
  /// `rendered`: of opened.to_core, where that was to be stepped.
  [[nodiscard]] ServoResult close(const ServoInput& input, const Opened& opened,
                                  const StepResult& rendered) noexcept;

  /// The device exerts a force, or is about to.
  [[nodiscard]] bool is_felt() const noexcept;
  /// The call for an emergency stop, or the device's own, is there.
  [[nodiscard]] bool is_stopped(const ServoInput& input) const noexcept;

 private:
  ServoTick(HapticCore* core, PartHand* hand, const ServoParameters& parameters,
            const SceneCapacity& bounds, FlightRecorder* recorder) noexcept;
  void reset_core() noexcept;
  [[nodiscard]] StepResult step_core(const StepInput& input) noexcept;
  [[nodiscard]] const SceneCapacity& bounds() const noexcept;
  [[nodiscard]] Vec3 felt_grip_a() const noexcept;
  void follow_limits(const LimitsRecord& record) noexcept;
  [[nodiscard]] std::uint32_t check_device(const ServoInput& input) const noexcept;
  void follow_state(const ServoInput& input, bool is_new) noexcept;
  [[nodiscard]] std::uint32_t check_pose(const DeviceState& state) noexcept;
  [[nodiscard]] std::uint32_t check_time(const ServoInput& input) noexcept;
  [[nodiscard]] std::uint32_t check_frame(const ServoInput& input) noexcept;
  [[nodiscard]] std::uint32_t waits(const ServoInput& input, std::uint32_t present) const noexcept;
  void prepare(const ServoInput& input, Opened& opened) noexcept;
  [[nodiscard]] std::uint32_t check_rendered() noexcept;
  [[nodiscard]] std::uint32_t check_envelope() noexcept;
  void arm(const ServoInput& input, std::uint32_t present) noexcept;
  [[nodiscard]] Wrench exerted(const Wrench& wrench_w) const noexcept;
  void record(const ServoInput& input, const ServoResult& result) noexcept;

  /// The newest state of the device.
  struct FollowedState {
    DeviceState state;
    std::int64_t period_ns = 0;  ///< between two states of a device on time
    std::int64_t seen_ns = 0;    ///< when it was first seen
    Twist twist_d;               ///< of the handle: reported, or by the last two poses
    Vec3 arm_d = Vec3::Zero();   ///< from the sensed point to the handle point
    std::uint32_t faults = 0;    ///< causes that lie in it: present until the next
    bool was_ready = false;      ///< the link, ever
    bool has_state = false;      ///< it is of this opening of the link
    bool has_pose = false;       ///< its pose is one that the next can be compared with
  };
  /// The last state that the core has rendered.
  struct LastRendered {
    StepResult result;
    bool has_result = false;      ///< ever
    bool started_inside = false;  ///< and has not come out since
    std::uint32_t out_ticks = 0;  ///< the goal is outside its limits, or has just come back
  };

  HapticCore* core_;  ///< null: the hand's
  PartHand* hand_;    ///< null: there is one core
  ServoParameters parameters_;
  SceneCapacity bounds_;
  FlightRecorder* recorder_;
  Arming arming_;
  SafetyLimits own_limits_;        ///< the parameters'; parameters_.limits: those in force
  std::uint32_t limits_from_ = 0;  ///< connection whose limits are in force; 0: own_limits_
  OutputLimiter limiter_;
  MovingFrame frame_;
  EnvelopeWatch watch_;  ///< over the goal
  FollowedState device_;
  LastRendered rendered_;
  std::uint64_t tick_ = 0;
  std::int64_t now_ns_ = 0;  ///< of the last tick
  std::uint32_t late_ = 0;   ///< periods by which state or tick are late now
  bool usable_ = false;      ///< the parameters
  bool full_ = false;        ///< the ramp in is over
  bool broken_ = true;       ///< the next pose does not go on from the core's last
  bool drops_pull_ = false;  ///< nor does the pull
};

}  // namespace haptic
