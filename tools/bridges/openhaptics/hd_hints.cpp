// SPDX-License-Identifier: Apache-2.0
#include "tools/bridges/openhaptics/hd_hints.hpp"

#include <cstdlib>
#include <filesystem>

namespace haptic::tools {
namespace {

// The name under which the vendor's set-up program pairs the one device that there is.
constexpr const char* kDefaultDevice = "Default Device";

/// Where the drivers keep a device's pairing: $GTDD_HOME/config, else ~/.3dsystems/config.
std::string pairing_hint(const std::string& device) {
  const char* const home = std::getenv("GTDD_HOME");
  if (home == nullptr || *home == '\0')
    return "the variable GTDD_HOME is not set: the driver looks for the device's pairing in "
           "$GTDD_HOME/config; set it (usually to /usr/share/3DSystems or ~/.3dsystems) and pair "
           "the device by the vendor's Touch_Setup";
  const std::filesystem::path file = std::filesystem::path(home) / "config" /
                                     ((device.empty() ? kDefaultDevice : device) + ".config");
  std::error_code error;
  if (std::filesystem::exists(file, error)) return {};
  return "there is no " + file.string() +
         ": pair the device by the vendor's Touch_Setup, under the name that the key device has";
}

std::string cause_hint(const HdErrorInfo& error) {
  switch (error.code) {
    case kHdAlreadyInitiated:
    case kHdInvalidValue:
    case kHdTimerError:
      return "another program may have it: one at a time can";
    case kHdInvalidLicense:
      return "OpenHaptics finds no licence";
    default:
      return "check its supply and cable, and that you may read and write it (group dialout for "
             "/dev/ttyACM*, the udev rule for /dev/hidraw*)";
  }
}

}  // namespace

bool is_hd_version(const std::string& version) noexcept {
  const std::size_t at = version.find_first_of("0123456789");
  if (at == std::string::npos) return true;
  const std::size_t end = version.find_first_not_of("0123456789", at);
  return version.substr(at, end == std::string::npos ? end : end - at) == "3";
}

std::string hd_open_hint(const HdErrorInfo& error, const std::string& device) {
  const std::string pairing = pairing_hint(device);
  return cause_hint(error) + (pairing.empty() ? "" : "; " + pairing);
}

std::string hd_calibration_hint(int style) {
  if ((style & kHdInkwell) != 0) return "put the stylus into the inkwell";
  if ((style & kHdAuto) != 0) return "move the handle through its workspace";
  return "hold the handle in its reset position and calibrate it by the vendor's Touch_Diagnostic";
}

}  // namespace haptic::tools
