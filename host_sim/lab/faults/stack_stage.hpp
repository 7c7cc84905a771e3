// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The stage of the fault matrix in one thread and in the device's own time: equal scripts, equal
/// bits.

#include <span>

#include "host_sim/lab/faults/fault_run.hpp"
#include "host_sim/lab/faults/fault_stage.hpp"

namespace haptic::sim {

/// Commands of a faulty servo thread.
[[nodiscard]] DeviceCommand spoiled(FaultCause cause, DeviceCommand command);

class StackStage final : public FaultStage {
 public:
  /// `stack`: fault_stack of settings and place.
  StackStage(std::span<const std::byte> scene, const StackSettings& stack);
  ~StackStage() override;

  [[nodiscard]] ReferenceUsb& bus() override { return stack_.bus(); }
  void emergency_stop() override { stack_.emergency_stop(); }
  void stall_servo(unsigned /*periods*/) override { stack_.stall_servo(true); }
  void spoil_commands(FaultCause cause) override;
  void lose_servo() override;
  void release_servo() override;
  void restart_servo() override;
  void unplug() override { stack_.unplug(); }
  void plug(bool power) override { stack_.plug(power); }

 private:
  FaultSample pass_period() override;

  CoreSession session_;
  StackCarrier carrier_;
  std::uint32_t accepted_ = 0;
  DeviceStack stack_;
};

}  // namespace haptic::sim
