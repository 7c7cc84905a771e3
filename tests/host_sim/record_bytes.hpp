// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Records of a recorded session's file, for tests that change one of them.

#include <doctest/doctest.h>

#include <cstdint>
#include <span>
#include <vector>

#include "hal/drivers/reference_codec.hpp"
#include "hal/usb/bus_record.hpp"

namespace haptic::sim::test {

/// Bytes of a record before its payload.
inline constexpr std::size_t kRecordHead = 8;

/// The `count`th record of a kind, from 0 on; there must be one.
inline hal::BusRecord record_of(const std::vector<std::uint8_t>& file, std::uint8_t kind,
                                std::size_t count) {
  hal::BusSession header;
  std::size_t first = 0;
  REQUIRE(hal::read_header(file, header, first).text.empty());
  hal::BusRecordReader reader(file, first);
  hal::BusRecord record;
  while (reader.next(record)) {
    if (record.kind == kind && count-- == 0) return record;
  }
  REQUIRE(false);
  return record;
}

/// The check sum of `size` bytes from `begin` on, behind them.
inline void put_check(std::vector<std::uint8_t>& file, std::size_t begin, std::size_t size) {
  const std::uint32_t check = hal::crc32(std::span(file).subspan(begin, size));
  for (std::size_t k = 0; k < 4; ++k)
    file[begin + size + k] = static_cast<std::uint8_t>(check >> (8 * k));
}

}  // namespace haptic::sim::test
