// SPDX-License-Identifier: Apache-2.0
#include <charconv>
#include <cstdint>
#include <string_view>

#include "hal/usb/usb_link.hpp"

namespace haptic::hal {
namespace {

// One to four hexadecimal digits and nothing else; 0 is no identity.
bool parse_identity(std::string_view text, std::uint16_t& value) {
  if (text.empty() || text.size() > 4) return false;
  std::uint16_t parsed = 0;
  const char* end = text.data() + text.size();
  const auto result = std::from_chars(text.data(), end, parsed, 16);
  if (result.ec != std::errc{} || result.ptr != end || parsed == 0) return false;
  value = parsed;
  return true;
}

bool is_number(std::string_view text) {
  std::uint8_t value = 0;
  const char* end = text.data() + text.size();
  const auto result = std::from_chars(text.data(), end, value);
  return result.ec == std::errc{} && result.ptr == end && value > 0 && text.front() != '0';
}

// Bus, hyphen, up to seven ports joined by points: "1-2.3".
bool is_bus_path(std::string_view text) {
  constexpr int kMostPorts = 7;
  const std::size_t hyphen = text.find('-');
  if (hyphen == std::string_view::npos || !is_number(text.substr(0, hyphen))) return false;
  std::string_view ports = text.substr(hyphen + 1);
  for (int k = 0; k < kMostPorts; ++k) {
    const std::size_t point = ports.find('.');
    if (!is_number(ports.substr(0, point))) return false;
    if (point == std::string_view::npos) return true;
    ports.remove_prefix(point + 1);
  }
  return false;
}

}  // namespace

bool parse_usb_address(const std::string& text, UsbAddress& address) {
  UsbAddress parsed;
  if (is_bus_path(text)) {
    parsed.bus_path = text;
    address = parsed;
    return true;
  }
  std::string_view all = text;
  // A serial number may hold the sign too: what follows must be a place on the bus.
  const std::size_t at = all.rfind('@');
  if (at != std::string_view::npos && is_bus_path(all.substr(at + 1))) {
    parsed.bus_path = all.substr(at + 1);
    all = all.substr(0, at);
  }
  const std::size_t first = all.find(':');
  if (first == std::string_view::npos) return false;
  const std::size_t second = all.find(':', first + 1);
  const std::size_t length = second == std::string_view::npos ? second : second - first - 1;
  if (!parse_identity(all.substr(0, first), parsed.vendor_id) ||
      !parse_identity(all.substr(first + 1, length), parsed.product_id))
    return false;
  if (second != std::string_view::npos) {
    parsed.serial = all.substr(second + 1);  // may itself hold colons
    if (parsed.serial.empty()) return false;
  }
  address = parsed;
  return true;
}

}  // namespace haptic::hal
