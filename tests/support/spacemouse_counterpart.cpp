// SPDX-License-Identifier: Apache-2.0
#include "tests/support/spacemouse_counterpart.hpp"

#include <algorithm>
#include <initializer_list>

#include "hal/drivers/spacemouse_codec.hpp"

namespace haptic::test {

std::vector<std::uint8_t> spacemouse_descriptor(std::int16_t range, bool joined) {
  const auto most = static_cast<std::uint16_t>(range);
  const auto least = static_cast<std::uint16_t>(-range);
  const auto low = [](std::uint16_t x) { return static_cast<std::uint8_t>(x & 0xff); };
  const auto high = [](std::uint16_t x) { return static_cast<std::uint8_t>(x >> 8); };
  std::vector<std::uint8_t> d{
      0x05, 0x01,                          // usage page: generic desktop
      0x09, 0x08,                          // usage: multi-axis controller
      0xa1, 0x01,                          // collection: application
      0xa1, 0x00,                          // collection: physical
      0x85, 0x01,                          // report 1
      0x16, low(least), high(least),       // logical minimum
      0x26, low(most),  high(most),        // logical maximum
      0x36, 0x88,       0xfa,              // physical minimum
      0x46, 0x78,       0x05,              // physical maximum
      0x55, 0x0c,       0x65,        0x11  // unit: tenths of a millimetre
  };
  const auto put = [&d](std::initializer_list<int> bytes) {
    for (const int byte : bytes) d.push_back(static_cast<std::uint8_t>(byte));
  };
  const auto axes = [&put](int first, int count) {
    for (int i = 0; i < count; ++i) put({0x09, first + i});
    put({0x75, 0x10, 0x95, count, 0x81, 0x02});  // 16 bits each, input
  };
  if (joined) {
    axes(0x30, 6);
  } else {
    axes(0x30, 3);
    put({0xc0, 0xa1, 0x00, 0x85, 0x02});
    axes(0x33, 3);
  }
  put({0xc0});
  // Report 3: 15 buttons and a bit of filling.
  put({0xa1, 0x02, 0x85, 0x03, 0x05, 0x09, 0x19, 0x01, 0x29, 0x0f, 0x15, 0x00, 0x25, 0x01});
  put({0x75, 0x01, 0x95, 0x0f, 0x81, 0x02, 0x95, 0x01, 0x81, 0x03, 0xc0});
  // Report 4: a light and seven bits of filling.
  put({0xa1, 0x02, 0x85, 0x04, 0x05, 0x08, 0x09, 0x4b, 0x95, 0x01, 0x91, 0x02, 0x95, 0x07});
  put({0x91, 0x03, 0xc0, 0xc0});
  return d;
}

void SpaceMouseCounterpart::push(const std::array<std::int16_t, 6>& axes) {
  if (joined_) {
    const auto bytes = hal::encode_long(axes);
    reports_.emplace_back(bytes.begin(), bytes.end());
    return;
  }
  const std::span<const std::int16_t, 6> all(axes);
  const auto moved = hal::encode_short(1, all.first<3>());
  const auto turned = hal::encode_short(2, all.last<3>());
  reports_.emplace_back(moved.begin(), moved.end());
  reports_.emplace_back(turned.begin(), turned.end());
}

void SpaceMouseCounterpart::press(std::uint32_t buttons) {
  std::vector<std::uint8_t> report{3};
  for (int i = 0; i < 4; ++i) report.push_back(static_cast<std::uint8_t>(buttons >> (8 * i)));
  reports_.push_back(report);
}

void SpaceMouseCounterpart::say_battery(std::uint8_t percent) { reports_.push_back({23, percent}); }

bool SpaceMouseCounterpart::on_control(const hal::ControlRequest& request,
                                       std::span<std::uint8_t> bytes, std::size_t& moved) {
  moved = 0;
  if (request.request_type == 0x81 && request.request == 0x06 && request.value == 0x2200) {
    if (descriptor.empty()) return false;
    moved = std::min(bytes.size(), descriptor.size());
    std::copy_n(descriptor.begin(), moved, bytes.begin());
    return true;
  }
  if (request.request_type == 0x21 && request.request == 0x09 && request.value == 0x0204) {
    if (!takes_light || bytes.size() != 2 || bytes[0] != hal::kSpaceMouseLightReport) return false;
    light_ = bytes[1];
    moved = bytes.size();
    return true;
  }
  return false;
}

std::size_t SpaceMouseCounterpart::on_in(std::span<std::uint8_t> bytes) {
  if (reports_.empty()) return 0;
  const std::vector<std::uint8_t> report = reports_.front();
  reports_.pop_front();
  const std::size_t count = std::min(bytes.size(), report.size());
  std::copy_n(report.begin(), count, bytes.begin());
  return count;
}

}  // namespace haptic::test
