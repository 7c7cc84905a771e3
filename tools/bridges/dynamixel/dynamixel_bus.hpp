// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Single requests to a servo, answered or given up within a stated time: for opening and closing.

#include <cstdint>
#include <span>
#include <string>

#include "tools/bridges/dynamixel/dynamixel_packet.hpp"
#include "tools/bridges/serial/serial_port.hpp"

namespace haptic::tools {

enum class DynamixelReply : std::uint8_t {
  kDone = 0,
  kSilent,   ///< no answer, or none whose check sum is right
  kRefused,  ///< answered with an error number: value, access or limit
  kOther     ///< the register holds another value than the one written
};

/// A servo as it was found.
struct DynamixelIdentity {
  std::uint16_t model = 0;
  std::uint8_t firmware = 0;
};

class DynamixelBus {
 public:
  explicit DynamixelBus(SerialPort& port) : port_(port) {}

  [[nodiscard]] DynamixelReply ping(std::uint8_t id, DynamixelIdentity& identity);
  /// `data.size()` bytes from register `address` on.
  [[nodiscard]] DynamixelReply read(std::uint8_t id, std::uint16_t address,
                                    std::span<std::uint8_t> data);
  /// Writes a register of one byte and reads it back.
  [[nodiscard]] DynamixelReply set(std::uint8_t id, std::uint16_t address, std::uint8_t value);

 private:
  /// Up to kAttempts times, kAnswer_ns each.
  [[nodiscard]] DynamixelReply ask(std::uint8_t id, DynamixelInstruction instruction,
                                   std::span<const std::uint8_t> parameters,
                                   std::span<std::uint8_t> answer);

  SerialPort& port_;
  DynamixelInput input_;
};

/// An answer takes 1 ms of line and 1 to 16 ms of an adapter's latency.
inline constexpr std::int64_t kAnswer_ns = 34'000'000;
inline constexpr int kAttempts = 3;

}  // namespace haptic::tools
