// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The configuration of `run_device run`: scene, one device or two with workspace, limits and
/// switches each, loop, recorder. The table of keys is in README.md.

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "hal/drivers/driver.hpp"
#include "hal/input/gripper_switch.hpp"
#include "hal/input/key_switch.hpp"
#include "hal/usb/usb_link.hpp"
#include "rt_core/servo_tick.hpp"

namespace haptic::tools {

struct LoopConfig {
  std::int64_t period_ns = 1'000'000;
  bool report_clocked = false;
  int servo_priority = 80, usb_priority = 79;  ///< SCHED_FIFO; 0: ordinary
  int servo_cpu = -1, usb_cpu = -1;            ///< negative: any
  bool lock_memory = true;
  /// Nothing arms unless Linux grants all that is asked for and wake-ups are in time. Default:
  /// where the device has motors. Else such a device gets less force (machine_fit).
  bool strict = false;
};

/// A bridge that a run starts and ends.
struct BridgeCall {
  std::string name;                ///< of the bridge; empty: none
  std::vector<std::string> words;  ///< its keys, as arguments
  [[nodiscard]] bool is_used() const { return !name.empty(); }
};

/// A device, with all that is its own.
struct HandDevice {
  std::string driver_name;  ///< as in the file, or as --device has it
  bool simulated = false;   ///< the peer in this process, no bus
  hal::UsbAddress address;
  std::string socket_path;  ///< of a device in another process; empty: a bridge's or the bus's
  BridgeCall bridge;
  hal::KeySwitchSettings deadman_input;  ///< no path: the device's own switches alone
  hal::GripperSettings gripper;          ///< not used: the gripper is no switch
  std::unique_ptr<hal::Driver> driver;
  bool has_motors = false;  ///< force can reach a hand
  ServoParameters servo;    ///< except for grip point and start, which the scene has
};

struct DeviceConfig {
  std::filesystem::path file;       ///< itself, for messages
  std::filesystem::path scene;      ///< of the compiled scene, from the working folder
  std::vector<HandDevice> devices;  ///< by hand of the scene; one or two
  bool accept_unbudgeted = false;   ///< gains beyond a device's passivity budget, or without one
  LoopConfig loop;
  double flight_seconds = 4.0;
  bool in_session = false;  ///< a program with a session reads the ticks (run_session.hpp)
  const NewestRecord<FrameRecord>* frames =
      nullptr;                       ///< and moves the fixed parts; null: they stand
  std::filesystem::path crash_file;  ///< empty: the last ticks go to stderr alone

  [[nodiscard]] bool has_two() const { return devices.size() > 1; }
  [[nodiscard]] bool has_motors() const {
    return std::ranges::any_of(devices, &HandDevice::has_motors);
  }
};

/// "device 2: ", in front of what is said of one of two; of the only one nothing.
[[nodiscard]] std::string device_words(const DeviceConfig& config, std::size_t device);

/// The crash file of a device: that of the second has its number before the ending.
[[nodiscard]] std::filesystem::path crash_file_of(const std::filesystem::path& file,
                                                  std::size_t device);

/// Names that [device] driver may have: those of hal/drivers/driver_registry.hpp, and "sim".
[[nodiscard]] bool is_driver_name(const std::string& name);

/// "the drivers are: ..., sim".
[[nodiscard]] std::string driver_list();

/// For the help: each with its product and its keys, a line each.
[[nodiscard]] std::string driver_help();

/// Paths in the file count from its folder.
/// @param device   instead of the file's [device] driver; empty: as the file says.
/// @param device2  the same of [device2], which the file then need not have.
/// @throws InputError "file:line:column: defect; fix" for what is missing, unknown, of the wrong
///   type, out of its range, or beyond the limits of the device.
[[nodiscard]] DeviceConfig read_device_config(const std::filesystem::path& path,
                                              const std::string& device,
                                              const std::string& device2 = "");

}  // namespace haptic::tools
