// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Registers that X-series servos have in common, and the models that leader arms are built of.
/// Source: the control tables and specifications of emanual.robotis.com/docs/en/dxl/x/.

#include <cstdint>
#include <span>
#include <string_view>

namespace haptic::tools {

/// Registers of the X series that the bridge reads or writes.
namespace dynamixel_register {
inline constexpr std::uint16_t kReturnDelay = 9;     ///< 2 us
inline constexpr std::uint16_t kOperatingMode = 11;  ///< in EEPROM: torque must be off
inline constexpr std::uint16_t kCurrentLimit = 38;   ///< 2 bytes
inline constexpr std::uint16_t kTorqueEnable = 64;
inline constexpr std::uint16_t kHardwareError = 70;
inline constexpr std::uint16_t kBusWatchdog = 98;      ///< 20 ms; reads -1 after a cut
inline constexpr std::uint16_t kGoalCurrent = 102;     ///< 2 bytes
inline constexpr std::uint16_t kPresentCurrent = 126;  ///< 2 bytes, then velocity and position
}  // namespace dynamixel_register

/// Present current (2 bytes), velocity (4) and position (4), one behind the other.
inline constexpr std::size_t kPresentBytes = 10;

inline constexpr std::uint8_t kCurrentMode = 0;
inline constexpr double kVelocityUnit_rad_per_s = 0.229 * 6.283185307179586 / 60;

/// Watchdog value that is set: 20 ms. After it a servo stops by itself.
inline constexpr std::uint8_t kWatchdogSet = 1;
inline constexpr std::uint8_t kWatchdogCut = 0xff;

/// Bits of the hardware error status.
inline constexpr std::uint8_t kErrorVoltage = 1u << 0, kErrorOverheating = 1u << 2,
                              kErrorEncoder = 1u << 3, kErrorShock = 1u << 4,
                              kErrorOverload = 1u << 5;
/// Bit of a status packet's error byte: the hardware error status is not 0.
inline constexpr std::uint8_t kAlertBit = 0x80;

struct DynamixelModel {
  std::uint16_t number;
  std::string_view name;
  std::uint8_t least_firmware;  ///< of fast sync read
  double current_unit_a;        ///< 0: it has no current mode
  /// Stall torque over stall current at the recommended voltage. Efficiency of the gears, heat and
  /// the servo itself change it by a fifth; sources differ as much (README.md).
  double torque_nm_per_a;
};

[[nodiscard]] std::span<const DynamixelModel> dynamixel_models() noexcept;
/// Null: not known.
[[nodiscard]] const DynamixelModel* find_model(std::uint16_t number) noexcept;

}  // namespace haptic::tools
