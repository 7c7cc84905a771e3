// SPDX-License-Identifier: Apache-2.0
#include "hal/realtime/plugged_devices.hpp"

#include <charconv>
#include <optional>

namespace haptic::hal {
namespace {

constexpr const char* kFolder = "/sys/bus/usb/devices";

std::optional<std::uint16_t> identity(const SystemTree& tree, const std::string& path) {
  const std::string text = tree.text(path).value_or("");
  std::uint16_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number, 16);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return number;
}

}  // namespace

std::vector<PluggedDevice> plugged_devices(const SystemTree& tree) {
  std::vector<PluggedDevice> found;
  for (const std::string& name : tree.names(kFolder)) {
    if (name.starts_with("usb") || name.find(':') != std::string::npos) continue;
    const std::string folder = std::string(kFolder) + "/" + name;
    const auto vendor = identity(tree, folder + "/idVendor");
    const auto product = identity(tree, folder + "/idProduct");
    if (!vendor || !product) continue;
    found.push_back({*vendor, *product, tree.text(folder + "/serial").value_or(""),
                     tree.text(folder + "/product").value_or(""), name,
                     static_cast<int>(tree.number(folder + "/busnum").value_or(0)),
                     static_cast<int>(tree.number(folder + "/devnum").value_or(0))});
  }
  return found;
}

}  // namespace haptic::hal
