// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Novint Falcon: three sensed and driven translations, four buttons. Bytes in falcon_codec, the
/// arm in falcon_kinematics, power-up in falcon_firmware.
///
/// Frame D: axes as the arm's frame F (x right, y up, z towards the operator), origin in the
/// middle of its workspace. The handle does not turn.
///
/// Until all three encoders are homed - the operator moves the grip in and out once - counts mean
/// nothing: the link is kStarting, the homing bit is set and no force is sent.

#include <string>
#include <vector>

#include "hal/drivers/driver.hpp"
#include "hal/drivers/falcon_codec.hpp"
#include "hal/drivers/falcon_kinematics.hpp"
#include "hal/drivers/sha256.hpp"

namespace haptic::hal {

/// Limits: 8 N, 3000 N/m, 20 N s/m and a radius of 40 mm as CHAI3D (BSD-3) lists them in
/// CDeltaDevices.cpp; one count of an encoder is 0.0364 degrees at the thigh, at most 60 um at the
/// handle. Rates of force, mass and friction are not known; a watchdog of its own neither.
[[nodiscard]] DeviceCapabilities falcon_capabilities() noexcept;

struct FalconSettings {
  std::string firmware_path;                 ///< Novint's image; needed once after each power-up
  std::vector<Sha256Digest> known_firmware;  ///< images that may be loaded ...
  bool accept_unknown_firmware = false;      ///< ... and any other
  int load_attempts = 3;                     ///< 1 to 10
  FalconGeometry geometry;
  DeviceCapabilities capabilities = falcon_capabilities();
};

class FalconDriver : public Driver {
 public:
  explicit FalconDriver(FalconSettings settings);

  /// Run mode; asks whether the firmware answers; loads it where it does not.
  /// @retval kBadFirmwareFile  it does not run, and the named file is no image.
  /// @retval kUnknownFirmwareFile  nor is its hash a known one.
  /// @retval kStartFailed      loading failed, or what was loaded does not answer.
  [[nodiscard]] HalStatus start(UsbPort& port) noexcept override;

  /// One transfer from the bridge: status bytes and what came of the stream with them. The
  /// newest whole packet is the state. kBadNumber: homed, but no position fits the counts; three
  /// such in a row start again from the middle.
  [[nodiscard]] ReportVerdict read(std::span<const std::uint8_t> report, std::int64_t stamp_ns,
                                   DeviceState& state) noexcept override;

  /// Joint torques for the force at the last position; the largest motor value is 4095, and all
  /// three are scaled together, so that the force keeps its direction. Zero while not homed, for a
  /// wrench that is not finite, and where the arm is singular.
  [[nodiscard]] std::size_t write(const Wrench& wrench_d, std::uint64_t tick,
                                  std::span<std::uint8_t> report,
                                  Wrench& delivered_d) noexcept override;
  [[nodiscard]] std::size_t zero_report(std::span<std::uint8_t> report) const noexcept override;

  /// Motor value per torque at the thigh [1/(N m)], as libnifalcon scales it; to be confirmed on
  /// the device.
  static constexpr double kMotorPerTorque = -10000.0;

 private:
  void forget() noexcept;
  [[nodiscard]] ReportVerdict take(const FalconReport& report, DeviceState& state) noexcept;

  FalconSettings settings_;
  FalconKinematics arm_;
  FalconStream stream_;
  Column3 position_f_;  ///< the last that fitted
  bool homed_ = false;
  bool placed_ = false;  ///< position_f_ is of this device, not the guess
  bool was_homed_ = false;
  int misfits_ = 0;
};

}  // namespace haptic::hal
