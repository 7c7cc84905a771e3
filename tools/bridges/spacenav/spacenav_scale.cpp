// SPDX-License-Identifier: Apache-2.0
#include "tools/bridges/spacenav/spacenav_scale.hpp"

#include <algorithm>
#include <charconv>
#include <fstream>
#include <string>

#include "hal/drivers/displacement_pose.hpp"

namespace haptic::tools {
namespace {

constexpr double kAbsoluteFullScale = 500;
constexpr std::size_t kMostListBytes = std::size_t{1} << 20;
constexpr unsigned kSixAxes = 0x3f;

/// The hexadecimal number right behind `key`; 0: there is none.
unsigned long number_behind(std::string_view line, std::string_view key) noexcept {
  unsigned long value = 0;
  const std::size_t at = line.find(key);
  if (at == std::string_view::npos) return 0;
  line.remove_prefix(at + key.size());
  (void)std::from_chars(line.data(), line.data() + line.size(), value, 16);
  return value;
}

}  // namespace

double spacenav_full_scale(std::string_view input_devices, std::uint16_t vendor_id,
                           std::uint16_t product_id) noexcept {
  bool is_it = false;
  while (!input_devices.empty()) {
    const std::size_t end = std::min(input_devices.find('\n'), input_devices.size());
    const std::string_view line = input_devices.substr(0, end);
    input_devices.remove_prefix(std::min(end + 1, input_devices.size()));
    if (line.starts_with("I:")) {
      is_it = number_behind(line, "Vendor=") == vendor_id &&
              number_behind(line, "Product=") == product_id;
    } else if (is_it && line.starts_with("B: ABS=")) {
      // Words of a bit field, the lowest last.
      const std::size_t last = std::max<std::size_t>(line.rfind(' '), 6);
      if ((number_behind(line.substr(last), line.substr(last, 1)) & kSixAxes) == kSixAxes)
        return kAbsoluteFullScale;
    }
  }
  return hal::kDisplacementFullScale;
}

double spacenav_full_scale(std::uint16_t vendor_id, std::uint16_t product_id) {
  std::string list(kMostListBytes, '\0');
  std::ifstream file("/proc/bus/input/devices", std::ios::binary);
  file.read(list.data(), static_cast<std::streamsize>(list.size()));
  list.resize(static_cast<std::size_t>(std::max<std::streamsize>(file.gcount(), 0)));
  return vendor_id == 0 ? hal::kDisplacementFullScale
                        : spacenav_full_scale(list, vendor_id, product_id);
}

}  // namespace haptic::tools
