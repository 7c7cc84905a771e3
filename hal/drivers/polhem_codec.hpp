// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Reports of the Polhem / WoodenHaptics board. Facts: haptikfabrikenapi, firmware/main.cpp and
/// fsusbhapticdevicethread.cpp (GPL-3; facts only). 14 bytes each way, seven signed 16-bit numbers,
/// little-endian, no report number.
///   to host:   encoder counts a b c d e f; info: 1 from the press of the calibration switch until
///              the counts are set
///   to device: motor currents a b c in mA; command; three arguments. Command 0: currents.
///              Command 1: set the counts, a b c from the arguments and d e f from the three fields
///              of the currents, which then are no currents

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace haptic::hal {

inline constexpr std::size_t kPolhemReportBytes = 14;

struct PolhemReport {
  std::array<std::int16_t, 6> counts{};
  bool switch_pressed = false;

  friend bool operator==(const PolhemReport&, const PolhemReport&) = default;
};

struct PolhemCommand {
  std::array<std::int16_t, 3> currents_ma{};
  bool set_counts = false;
  std::array<std::int16_t, 6> counts{};  ///< with set_counts; the currents are then zero

  friend bool operator==(const PolhemCommand&, const PolhemCommand&) = default;
};

enum class PolhemVerdict : std::uint8_t {
  kOk = 0,
  kBadLength,
  kBadNumber  ///< info or command is neither 0 nor 1
};

void encode(const PolhemReport& report, std::span<std::uint8_t, kPolhemReportBytes> bytes) noexcept;
void encode(const PolhemCommand& command,
            std::span<std::uint8_t, kPolhemReportBytes> bytes) noexcept;
/// The result is unchanged unless kOk.
[[nodiscard]] PolhemVerdict decode(std::span<const std::uint8_t> bytes,
                                   PolhemReport& report) noexcept;
[[nodiscard]] PolhemVerdict decode(std::span<const std::uint8_t> bytes,
                                   PolhemCommand& command) noexcept;

}  // namespace haptic::hal
