// SPDX-License-Identifier: Apache-2.0
/// Sentences on what keeps a serial bus slow or disturbs it.
#include <filesystem>
#include <fstream>

#include "tools/bridges/serial/serial_port.hpp"

namespace haptic::tools {
namespace {

/// "ttyUSB0" of a by-id path.
std::string device_name(const std::string& path) {
  std::error_code error;
  const std::filesystem::path real = std::filesystem::canonical(path, error);
  return (error ? std::filesystem::path(path) : real).filename().string();
}

}  // namespace

std::string serial_advice(const std::string& path, const SerialSystem& system) {
  const std::string name = device_name(path);
  std::string text;
  const std::string timer = "/sys/bus/usb-serial/devices/" + name + "/latency_timer";
  std::ifstream stream(system.root + timer);
  if (int wait_ms = 0; stream >> wait_ms && wait_ms > 1) {
    text += "The adapter holds answers back for " + std::to_string(wait_ms) +
            " ms: echo 1 | sudo tee " + timer + ", or a udev rule with ATTR{latency_timer}=\"1\".";
  }
  std::error_code error;
  // systemd has this link while the service runs.
  const auto unit = std::filesystem::symlink_status(
      system.root + "/run/systemd/units/invocation:ModemManager.service", error);
  if (name.starts_with("ttyACM") && std::filesystem::exists(unit)) {
    text += std::string(text.empty() ? "" : " ") +
            "ModemManager writes to a port like this after it was plugged in: sudo systemctl "
            "disable --now ModemManager, or a udev rule with ENV{ID_MM_DEVICE_IGNORE}=\"1\".";
  }
  return text;
}

}  // namespace haptic::tools
