// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A leader arm on Feetech STS servos (SO-100, SO-101) as a device that senses and does not push.
///
/// Why no force: these servos have no current mode, their open-loop PWM gives a torque that depends
/// on speed and supply, and they have no watchdog: if this program died, the last PWM would stay
/// on. The bridge writes no register of any servo.
///
/// An answer that is late or damaged costs the sample of its cycle, and the next question asks for
/// another length, so that a late answer is told apart; 100 ms without a sample, or an
/// adapter that is unplugged, is kLost.

#include <array>
#include <memory>

#include "hal/bridge/bridged_device.hpp"
#include "tools/bridges/arm/arm_settings.hpp"
#include "tools/bridges/feetech/feetech_packet.hpp"
#include "tools/bridges/serial/bus_timing.hpp"
#include "tools/bridges/serial/serial_port.hpp"

namespace haptic::tools {

class FeetechDevice final : public hal::BridgedDevice {
 public:
  explicit FeetechDevice(ArmSettings settings) : settings_(std::move(settings)) {}
  ~FeetechDevice() override { close(); }

  [[nodiscard]] bool open(std::string& why) override;
  [[nodiscard]] const hal::BridgeFacts& facts() const override { return facts_; }
  /// Between two samples kSame, and kSilent once one is late.
  [[nodiscard]] hal::BridgeRead read(std::int64_t now_ns, hal::BridgeSample& sample) override;
  /// Nothing is driven: a wrench is none of this device's.
  [[nodiscard]] bool write(std::int64_t, const Wrench&) override { return true; }
  [[nodiscard]] bool release(std::int64_t) override { return true; }
  void close() noexcept override;
  [[nodiscard]] pollfd watched() const noexcept override { return {port_.descriptor(), POLLIN, 0}; }

  [[nodiscard]] const CycleCounts& cycles() const noexcept { return counts_; }

 private:
  static constexpr std::size_t kMaxServos = kMaxJoints + 1;
  struct Servo {
    std::uint8_t id = 0, error = 0;
    int counts = 0;     ///< as it says
    double turned = 0;  ///< the same, going on across the end of a turn
    bool is_known = false;
  };

  [[nodiscard]] bool ask(std::uint8_t id, std::uint8_t address, std::span<std::uint8_t> data);
  [[nodiscard]] bool find_servos(std::string& why);
  [[nodiscard]] bool measure_cycle(std::string& why);
  void state_facts();
  void start(std::int64_t now_ns) noexcept;
  void take_answers(std::int64_t now_ns) noexcept;
  void take(const FeetechStatus& status, std::int64_t now_ns) noexcept;
  void finish_cycle(std::int64_t now_ns) noexcept;
  void miss() noexcept;
  [[nodiscard]] std::size_t joints() const noexcept { return settings_.arm.model.joint_count; }
  /// Bytes that a servo says of its presence in the newest question.
  [[nodiscard]] std::size_t present_bytes() const noexcept {
    return kFeetechPresentBytes + more_bytes_;
  }

  ArmSettings settings_;
  hal::BridgeFacts facts_;
  SerialPort port_;
  FeetechInput input_;
  CycleCounts counts_;
  std::array<Servo, kMaxServos> servos_;  ///< joints first, then the trigger
  std::size_t servo_count_ = 0;
  std::size_t answered_ = 0;    ///< servos in this cycle, which answer in their order
  std::size_t more_bytes_ = 0;  ///< 0 to 11, another one after each answer that has not come
  unsigned clean_poses_ = 0;    ///< since then
  bool is_asked_ = false;
  std::int64_t cycle_ns_ = 0, late_ns_ = 0, started_ns_ = 0, next_ns_ = 0, posed_ns_ = 0;
  bool is_open_ = false, posed_ = false, any_pose_ = false, trigger_pulled_ = false;
  JointNumbers angles_rad_{}, turns_rad_{};
  ArmPlace place_;
};

/// The device of a configuration's keys; null with `defect` filled.
[[nodiscard]] std::unique_ptr<hal::BridgedDevice> make_feetech(const hal::DriverOptions& options,
                                                               hal::DriverDefect& defect);

}  // namespace haptic::tools
