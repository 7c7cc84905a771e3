// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A socket's path of its own, and a bridge at an emulated spacenavd.

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>

#include "tests/bridges/spacenav/spacenav_emulator.hpp"
#include "tools/bridges/spacenav/spacenav_device.hpp"

namespace haptic::test {

class SocketFolder {
 public:
  SocketFolder() { (void)mkdtemp(folder_.data()); }
  ~SocketFolder() {
    std::error_code error;
    std::filesystem::remove_all(folder_, error);
  }
  SocketFolder(const SocketFolder&) = delete;
  SocketFolder& operator=(const SocketFolder&) = delete;
  [[nodiscard]] std::string path() const { return folder_ + "/spnav.sock"; }

 private:
  std::string folder_ = "/tmp/spacenav-XXXXXX";
};

/// The daemon listens; the device is plugged in where there is one.
struct SpacenavBench {
  explicit SpacenavBench(int version = 1, const EmulatedDevice& device = {})
      : daemon(folder.path(), version), bridge(settings(folder.path(), device)) {
    started = daemon.start();
    daemon.plug(device);
  }
  static tools::SpacenavSettings settings(const std::string& path, const EmulatedDevice& device) {
    tools::SpacenavSettings s;
    s.socket = path;
    s.full_scale = device.absolute ? 500 : device.maximum;
    return s;
  }
  /// Empty: it is open.
  [[nodiscard]] std::string open() {
    std::string why;
    return bridge.open(why) ? "" : "refused: " + why;
  }
  hal::BridgeRead read(std::int64_t now_ns) { return bridge.read(now_ns, sample); }

  SocketFolder folder;
  SpacenavEmulator daemon;
  tools::SpacenavDevice bridge;
  hal::BridgeSample sample;
  bool started = false;
};

}  // namespace haptic::test
