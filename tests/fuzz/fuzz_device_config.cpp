// SPDX-License-Identifier: Apache-2.0
/// The first byte: which driver the command line names, if any; the rest: any text as the
/// configuration of run_device. Read within the ranges of its keys and never beyond the limits of
/// the device, or refused with file, line and column.
#include <cmath>
#include <limits>

#include "hal/device_limits.hpp"
#include "hal/drivers/driver_registry.hpp"
#include "rt_core/safety/safety_limits.hpp"
#include "tests/fuzz/fuzz_target.hpp"
#include "tests/fuzz/memory_file.hpp"
#include "tools/common/error.hpp"
#include "tools/run_device/device_config.hpp"

namespace {

using namespace haptic;
using haptic::fuzz::require;

void check_loop(const tools::LoopConfig& loop) {
  require(loop.period_ns >= 100'000 && loop.period_ns <= 20'000'000, "the rate is in range");
  require(loop.servo_priority >= 0 && loop.servo_priority <= 99, "a priority of Linux");
  require(loop.usb_priority >= 0 && loop.usb_priority <= loop.servo_priority,
          "the USB thread does not interrupt the tick");
  require(
      loop.servo_cpu >= -1 && loop.servo_cpu < 1024 && loop.usb_cpu >= -1 && loop.usb_cpu < 1024,
      "cores have numbers");
}

void check_limits(const SafetyLimits& limits, const SafetyLimits& device) {
  constexpr Real SafetyLimits::*kFields[] = {
      &SafetyLimits::max_force_n,         &SafetyLimits::max_torque_nm,
      &SafetyLimits::slew_n_per_s,        &SafetyLimits::slew_nm_per_s,
      &SafetyLimits::full_speed_m_per_s,  &SafetyLimits::zero_speed_m_per_s,
      &SafetyLimits::full_turn_rad_per_s, &SafetyLimits::zero_turn_rad_per_s,
      &SafetyLimits::jump_speed_m_per_s,  &SafetyLimits::jump_turn_rad_per_s};
  const SafetyLimits used = usable(limits);
  for (const auto field : kFields) {
    require(std::isfinite(limits.*field) && limits.*field >= 0, "limits are numbers");
    require(limits.*field <= device.*field, "a limit can only be lowered");
    require(used.*field <= device.*field, "and what the stages make of it is no higher");
  }
  for (int k = 0; k < 3; ++k) {
    require(limits.max_axis_force_n[k] == device.max_axis_force_n[k] ||
                limits.max_axis_force_n[k] < device.max_axis_force_n[k],
            "axes too");
  }
  require((limits.driven_dof & ~device.driven_dof) == 0, "nothing else is driven");
  require(limits.ramp_in_s >= device.ramp_in_s, "a ramp can only be slower");
}

void check_device(const tools::HandDevice& device, const tools::LoopConfig& loop) {
  require(device.driver != nullptr && tools::is_driver_name(device.driver_name),
          "a driver that there is");
  check_limits(device.servo.limits, hal::limits_of(device.driver->capabilities(), loop.period_ns));
  const WorkspaceMap& map = device.servo.map;
  require(map.scale >= 1e-3_r && map.scale <= 1e3_r, "the scale is in range");
  require(std::abs(map.q_wd.norm() - 1) < 1e-5_r, "the rotation is one");
  require(is_finite(map.offset_w), "the offset is finite");
  const SwitchMap& switches = device.servo.switches;
  require((switches.deadman & switches.clutch) == 0, "deadman and clutch are apart");
}

void check_config(const tools::DeviceConfig& config) {
  require(config.devices.size() == 1 || config.devices.size() == 2, "one device, or two");
  check_loop(config.loop);
  for (const tools::HandDevice& device : config.devices) check_device(device, config.loop);
  require(config.flight_seconds >= 0.1 && config.flight_seconds <= 60, "the recorder fits memory");
}

/// None, then "sim", then the drivers.
std::string named_device(unsigned choice) {
  const auto rows = hal::driver_rows();
  const std::size_t chosen = choice % (rows.size() + 2);
  if (chosen < 2) return chosen == 0 ? "" : "sim";
  return std::string(rows[chosen - 2].name);
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static haptic::fuzz::MemoryFile file;
  if (size == 0) return 0;
  file.set({reinterpret_cast<const char*>(data + 1), size - 1});
  try {
    check_config(tools::read_device_config(file.path(), named_device(data[0])));
  } catch (const tools::InputError& error) {
    require(haptic::fuzz::names_place(error.what(), file.path(), 2) ||
                haptic::fuzz::names_place(error.what(), file.path(), 0),
            "a refusal begins with file, line and column");
  } catch (const tools::OsError&) {     // an output that cannot be written there
  } catch (const tools::UsageError&) {  // one that is an input
  }
  return 0;
}
