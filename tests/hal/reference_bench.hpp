// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The driver of the reference device, and a device that answers it without mechanics.

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>

#include "hal/drivers/reference_driver.hpp"

namespace haptic::hal::test {

/// A control pipe that answers as it is set.
class AnsweringPort : public UsbPort {
 public:
  HalStatus control(const ControlRequest& request, std::span<std::uint8_t> bytes,
                    std::size_t& moved, unsigned timeout_ms) noexcept override {
    ++asked;
    last = request;
    last_timeout_ms = timeout_ms;
    if (status != HalStatus::kOk) return status;
    if (bytes.size() > longest_known) return HalStatus::kTransferFailed;
    std::array<std::uint8_t, kReferenceLongBlockBytes> room{};
    std::span<std::uint8_t> answer = std::span(room).first(kReferenceBlockBytes);
    if (long_block && bytes.size() >= room.size()) {
      answer = room;
      encode(*long_block, room);
    } else {
      encode(block, answer.first<kReferenceBlockBytes>());
    }
    if (damaged_answers > 0) {
      --damaged_answers;
      answer[20] ^= 1;
    }
    moved = std::min({answer.size(), bytes.size(), longest});
    std::copy_n(answer.begin(), moved, bytes.begin());
    return HalStatus::kOk;
  }
  HalStatus write(std::span<const std::uint8_t>, unsigned) noexcept override {
    return HalStatus::kTransferFailed;
  }
  HalStatus read(std::span<std::uint8_t>, std::size_t&, unsigned) noexcept override {
    return HalStatus::kTransferFailed;
  }
  [[nodiscard]] bool cancelled() const noexcept override { return stop; }

  ReferenceBlock block;
  std::optional<ReferenceLongBlock> long_block;  ///< of a device of 1.1
  std::size_t longest_known = 4096;              ///< it stalls at a wLength beyond this
  HalStatus status = HalStatus::kOk;
  std::size_t longest = 128;
  int damaged_answers = 0;
  int asked = 0;
  bool stop = false;
  ControlRequest last;
  unsigned last_timeout_ms = 0;
};

/// A device of hal/drivers/PROTOCOL.md sections 7-9, without mechanics.
class ReferenceBench {
 public:
  explicit ReferenceBench(const std::optional<ReferenceLongBlock>& long_block = {}) {
    port.long_block = long_block;
    REQUIRE(driver.start(port) == HalStatus::kOk);
  }

  /// Next report of the device into the driver.
  ReportVerdict report() {
    ++device.sequence;
    unset(kReferenceDrivesOn);
    if (drives_on) set(kReferenceDrivesOn);
    return repeat_report();
  }
  ReportVerdict repeat_report() {
    std::array<std::uint8_t, kReferenceReportBytes> bytes{};
    encode(device, bytes);
    return driver.read(bytes, 0, state);
  }
  /// The driver's answer, taken by the device.
  std::size_t command(const Wrench& wrench) {
    std::array<std::uint8_t, kReferenceCommandBytes> bytes{};
    const std::size_t length = driver.write(wrench, ++tick, bytes, delivered);
    if (length == 0) return 0;
    REQUIRE(decode(std::span(bytes).first(length), sent) == CodecVerdict::kOk);
    on_the_way.push_back(sent);
    if (on_the_way.size() <= latency) return length;
    accept(on_the_way.front());
    on_the_way.pop_front();
    return length;
  }
  void accept(const ReferenceCommand& taken) {
    if (!is_newer(taken.sequence, device.accepted_sequence)) {
      ++device.rejected;
      return;
    }
    device.accepted_sequence = taken.sequence;
    device.accepted_tick = taken.tick;
    if (!taken.drives_on) {
      drives_on = fresh = false;
      unset(kReferenceWatchdogCut);
      if (!pressed) unset(kReferenceEmergencyStop);
    } else if (!fresh && (device.status & (kReferenceWatchdogCut | kReferenceEmergencyStop)) == 0 &&
               (device.status & kReferenceCalibrated) != 0) {
      drives_on = true;
    }
  }
  void set(ReferenceStatusBit bit) {
    device.status = static_cast<std::uint8_t>(device.status | bit);
    if (bit == kReferenceWatchdogCut || bit == kReferenceEmergencyStop) drives_on = false;
  }
  void unset(ReferenceStatusBit bit) {
    device.status = static_cast<std::uint8_t>(device.status & ~unsigned{bit});
  }
  /// Its firmware starts again, and the bus does not notice; already calibrated.
  void restart() {
    device.sequence = device.accepted_sequence = device.accepted_tick = device.rejected = 0;
    drives_on = false;
    fresh = true;
    on_the_way.clear();
  }
  /// Reports, each answered by a command of no force; the faults that the states had.
  std::uint32_t idle(std::size_t reports) {
    std::uint32_t seen = 0;
    for (std::size_t k = 0; k < reports; ++k) {
      REQUIRE(report() == ReportVerdict::kState);
      seen |= state.faults;
      REQUIRE(command({}) == kReferenceCommandBytes);
    }
    return seen;
  }
  /// Calibrated, drives confirmed, wrenches passed on.
  void bring_up() {
    set(kReferenceCalibrated);
    idle(5 + 2 * latency);
  }

  AnsweringPort port;
  ReferenceDriver driver;
  ReferenceReport device;
  bool drives_on = false, pressed = false;
  bool fresh = true;  ///< no command without the drives' bit since power-up
  DeviceState state;
  ReferenceCommand sent;
  Wrench delivered;
  std::uint64_t tick = 0;
  std::size_t latency = 0;  ///< commands take effect this many reports later
  std::deque<ReferenceCommand> on_the_way;
};

inline Wrench push(double x, double y, double z) {
  Wrench w;
  w.force_w = Vec3(static_cast<Real>(x), static_cast<Real>(y), static_cast<Real>(z));
  return w;
}

inline bool is_zero(const Wrench& w) { return w.force_w.isZero(0) && w.torque_w.isZero(0); }

}  // namespace haptic::hal::test
