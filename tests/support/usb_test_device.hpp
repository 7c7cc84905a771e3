// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The smallest device and driver that a link can be tested with: one number each way, a sequence
/// and a check word. The device is a UsbFunction, so the real libusb lies between the two.

#include <cstdint>
#include <functional>
#include <vector>

#include "hal/drivers/driver.hpp"
#include "host_sim/device/usbfs_carrier.hpp"

namespace haptic::test {

inline constexpr std::uint8_t kInEndpoint = 0x81, kOutEndpoint = 0x01;
inline constexpr std::size_t kReportBytes = 16, kCommandBytes = 16;

/// Report: sequence, position [um], 1 = ready, check. Command: force [uN] in x, tick, 1 = drives
/// off, check. All 32-bit little-endian; the check is the exclusive or of the three before it and a
/// constant.
using Words = std::array<std::uint32_t, 4>;
[[nodiscard]] std::array<std::uint8_t, 16> packed(Words words);
[[nodiscard]] Words unpacked(std::span<const std::uint8_t> bytes);
[[nodiscard]] bool checks(const Words& words);

struct UsbTestDevice final : sim::UsbFunction {
  [[nodiscard]] std::vector<std::uint8_t> descriptors() const override;
  [[nodiscard]] int speed() const override { return 3; }
  int control(std::uint8_t request_type, std::uint8_t request, std::uint16_t value,
              std::uint16_t index, std::span<std::uint8_t> bytes) override;
  int out(std::uint8_t endpoint, std::span<const std::uint8_t> bytes) override;

  bool interrupt_out = true;         ///< else the OUT endpoint is missing in its descriptors
  std::vector<double> forces_n;      ///< of every command that came
  std::vector<std::uint32_t> ticks;  ///< likewise
  unsigned damaged = 0;              ///< commands whose check was wrong
  unsigned halts_cleared = 0;
  unsigned released = 0;  ///< commands that take the drives off
  double force_before_release_n = -1;
  unsigned forces_after_release = 0;
  std::function<void()> on_command;
};

class UsbTestDriver final : public hal::Driver {
 public:
  UsbTestDriver();
  [[nodiscard]] hal::HalStatus start(hal::UsbPort& port) noexcept override;
  [[nodiscard]] hal::ReportVerdict read(std::span<const std::uint8_t> report, std::int64_t stamp_ns,
                                        DeviceState& state) noexcept override;
  [[nodiscard]] std::size_t write(const Wrench& wrench_d, std::uint64_t tick,
                                  std::span<std::uint8_t> report,
                                  Wrench& delivered_d) noexcept override;
  [[nodiscard]] std::size_t zero_report(std::span<std::uint8_t>) const noexcept override {
    return 0;
  }
  [[nodiscard]] std::size_t release(std::uint64_t tick,
                                    std::span<std::uint8_t> report) noexcept override;

  /// What the device says of itself from its next start on.
  void state(const hal::DeviceCapabilities& capabilities) { capabilities_ = capabilities; }

  bool releases = false;  ///< there is a report that takes the drives off
  std::function<hal::HalStatus(hal::UsbPort&)> on_start;
  int starts = 0;

 private:
  std::uint32_t last_ = 0;
};

}  // namespace haptic::test
