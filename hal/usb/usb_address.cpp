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

}  // namespace

bool parse_usb_address(const std::string& text, UsbAddress& address) {
  const std::string_view all = text;
  const std::size_t first = all.find(':');
  if (first == std::string_view::npos) return false;
  const std::size_t second = all.find(':', first + 1);
  UsbAddress parsed;
  const std::size_t length = second == std::string_view::npos ? second : second - first - 1;
  if (!parse_identity(all.substr(0, first), parsed.vendor_id) ||
      !parse_identity(all.substr(first + 1, length), parsed.product_id))
    return false;
  if (second != std::string_view::npos) {
    parsed.serial = text.substr(second + 1);  // may itself hold colons
    if (parsed.serial.empty()) return false;
  }
  address = parsed;
  return true;
}

}  // namespace haptic::hal
