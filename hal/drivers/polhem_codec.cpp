// SPDX-License-Identifier: Apache-2.0
#include "hal/drivers/polhem_codec.hpp"

#include <algorithm>

namespace haptic::hal {
namespace {

using Numbers = std::array<std::int16_t, 7>;

void put(const Numbers& numbers, std::span<std::uint8_t, kPolhemReportBytes> bytes) noexcept {
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const auto pattern = static_cast<std::uint16_t>(numbers[i]);
    bytes[2 * i] = static_cast<std::uint8_t>(pattern & 0xffu);
    bytes[2 * i + 1] = static_cast<std::uint8_t>(pattern >> 8);
  }
}

Numbers numbers_of(std::span<const std::uint8_t> bytes) noexcept {
  Numbers numbers{};
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    numbers[i] =
        static_cast<std::int16_t>(static_cast<std::uint16_t>(bytes[2 * i] | bytes[2 * i + 1] << 8));
  }
  return numbers;
}

bool is_flag(std::int16_t number) noexcept { return number == 0 || number == 1; }

}  // namespace

void encode(const PolhemReport& report,
            std::span<std::uint8_t, kPolhemReportBytes> bytes) noexcept {
  Numbers numbers{};
  std::copy(report.counts.begin(), report.counts.end(), numbers.begin());
  numbers[6] = report.switch_pressed ? 1 : 0;
  put(numbers, bytes);
}

void encode(const PolhemCommand& command,
            std::span<std::uint8_t, kPolhemReportBytes> bytes) noexcept {
  Numbers numbers{};
  if (command.set_counts) {
    std::copy(command.counts.begin() + 3, command.counts.end(), numbers.begin());
    numbers[3] = 1;
    std::copy(command.counts.begin(), command.counts.begin() + 3, numbers.begin() + 4);
  } else {
    std::copy(command.currents_ma.begin(), command.currents_ma.end(), numbers.begin());
  }
  put(numbers, bytes);
}

PolhemVerdict decode(std::span<const std::uint8_t> bytes, PolhemReport& report) noexcept {
  if (bytes.size() != kPolhemReportBytes) return PolhemVerdict::kBadLength;
  const Numbers numbers = numbers_of(bytes);
  if (!is_flag(numbers[6])) return PolhemVerdict::kBadNumber;
  std::copy(numbers.begin(), numbers.begin() + 6, report.counts.begin());
  report.switch_pressed = numbers[6] == 1;
  return PolhemVerdict::kOk;
}

PolhemVerdict decode(std::span<const std::uint8_t> bytes, PolhemCommand& command) noexcept {
  if (bytes.size() != kPolhemReportBytes) return PolhemVerdict::kBadLength;
  const Numbers numbers = numbers_of(bytes);
  if (!is_flag(numbers[3])) return PolhemVerdict::kBadNumber;
  command = PolhemCommand{};
  command.set_counts = numbers[3] == 1;
  if (command.set_counts) {
    std::copy(numbers.begin() + 4, numbers.end(), command.counts.begin());
    std::copy(numbers.begin(), numbers.begin() + 3, command.counts.begin() + 3);
  } else {
    std::copy(numbers.begin(), numbers.begin() + 3, command.currents_ma.begin());
  }
  return PolhemVerdict::kOk;
}

}  // namespace haptic::hal
