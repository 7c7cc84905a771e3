// SPDX-License-Identifier: Apache-2.0
#pragma once
/// One cell of the fault matrix, run: the whole stack over a simulated device, a cube that a
/// simulated hand presses on a wall. The state is reached, the fault comes, its cause goes, and the
/// operator takes force again.

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "host_sim/device/device_stack.hpp"
#include "host_sim/lab/faults/fault_script.hpp"
#include "host_sim/lab/faults/fault_stage.hpp"
#include "host_sim/lab/faults/fault_table.hpp"

namespace haptic::sim {

// The stage of the fault matrix in one thread and in the device's own time: equal scripts, equal
// bits.

/// Commands of a faulty servo thread.
[[nodiscard]] DeviceCommand spoiled(FaultCause cause, DeviceCommand command);

class StackStage final : public FaultStage {
 public:
  /// `stack`: fault_stack of settings and place.
  StackStage(std::span<const std::byte> scene, const StackSettings& stack);
  /// With a device for each hand; the fault is at that of hand `faulty`.
  StackStage(std::span<const std::byte> scene, const std::vector<StackSettings>& stacks,
             std::size_t faulty);
  ~StackStage() override;

  [[nodiscard]] const FaultSample* other() const override { return has_other_ ? &other_ : nullptr; }
  void leave_other() override { other_plan_ = hand(); }
  [[nodiscard]] ReferenceUsb& bus() override { return stack_.bus(faulty_); }
  void emergency_stop() override { stack_.emergency_stop(); }
  void stop_link() override { stack_.stop_link(faulty_); }
  void suspend() override { stack_.suspend(); }
  void stall_servo(unsigned /*periods*/) override { stack_.stall_servo(true); }
  void spoil_commands(FaultCause cause) override;
  void lose_servo() override;
  void release_servo() override;
  void restart_servo() override;
  void unplug() override { stack_.unplug(faulty_); }
  void plug(bool power) override { stack_.plug(power, faulty_); }

 private:
  FaultSample pass_period() override;
  [[nodiscard]] std::vector<StackDevice> devices(const std::vector<StackSettings>& stacks);
  [[nodiscard]] FaultSample sample_of(std::size_t hand);

  CoreSession session_;
  StackCarrier carrier_;
  std::size_t faulty_ = 0;
  bool has_other_ = false;
  std::optional<HandPlan> other_plan_;  ///< since leave_other
  FaultSample other_;
  std::array<std::uint32_t, kMostHands> accepted_{};
  DeviceStack stack_;
};

struct FaultSettings {
  StackCarrier carrier = StackCarrier::kUsb;
  bool report_clocked = false;
  /// Of the stack; what is judged are the reference device's own (reference_stack).
  double slew_factor = 1;
  double ramp_in_factor = 1;
  /// Two: each hand has its cube and its device, and the fault is at that of hand `faulty`.
  unsigned hands = 1;
  std::size_t faulty = 0;
};

/// What part of a scene a script plays on: D's z axis points off the wall that the part is pressed
/// on, and the part touches at kTouchHeight_m.
struct FaultPlace {
  WorkspaceMap map;
  MotionEnvelope envelope;  ///< what "workspace left" and "envelope left" leave
};
/// Of fault_scene().
[[nodiscard]] FaultPlace fault_place();
/// In another scene: from its start pose straight to the nearest fixed part. The part must not
/// touch at the start, and have room to slide sideways. @throws tools::InputError  nothing is
/// touched that way.
[[nodiscard]] FaultPlace fault_place(CoreSession& session);

/// The reference device in a firm hand, for a script at that place.
[[nodiscard]] StackSettings fault_stack(const FaultSettings& settings, const FaultPlace& place);

/// Compiled scene of all cells: the cube and the wall; for two hands a cube for each, beside each
/// other.
[[nodiscard]] std::vector<std::byte> fault_scene(unsigned hands = 1);

/// Same arguments, same bits. `scene`: fault_scene(settings.hands). @throws tools::InputError  the
/// state is not reached, or the fault needs a bus that the carrier is not.
[[nodiscard]] FaultTrace run_fault(std::span<const std::byte> scene, const FaultCase& cell,
                                   const FaultSettings& settings);

}  // namespace haptic::sim
