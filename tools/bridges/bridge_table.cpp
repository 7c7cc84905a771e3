// SPDX-License-Identifier: Apache-2.0
#include "tools/bridges/bridge_table.hpp"

#include <memory>
#include <utility>
#include <vector>

#include "tools/bridges/dynamixel/dynamixel_device.hpp"
#include "tools/bridges/feetech/feetech_device.hpp"
#include "tools/bridges/forcedimension/dhd_handle.hpp"
#include "tools/bridges/forcedimension/forcedimension_device.hpp"
#include "tools/bridges/haply/haply_device.hpp"
#include "tools/bridges/haply/haply_replay.hpp"
#include "tools/bridges/openhaptics/hd_handle.hpp"
#include "tools/bridges/openhaptics/openhaptics_device.hpp"
#include "tools/bridges/spacenav/spacenav_device.hpp"
#include "tools/bridges/vendor/vendor_replay.hpp"

namespace haptic::tools {

namespace {

ReplayResult replay_messages(Recording& recording, hal::BridgedDevice&) {
  return replay_haply(recording);
}
ReplayResult replay_frames(Recording& recording, hal::BridgedDevice&) {
  return replay_turns(recording, [](const VendorNumbers& n, std::shared_ptr<hal::DeviceTap> tap) {
    return std::make_unique<HdHandle>(HdCalls{}, 0, hd_settings_of(n), std::move(tap));
  });
}
ReplayResult replay_dhd(Recording& recording, hal::BridgedDevice&) {
  return replay_turns(recording, [](const VendorNumbers& n, std::shared_ptr<hal::DeviceTap> tap) {
    return std::make_unique<DhdHandle>(DhdCalls{}, '\0', dhd_settings_of(n), std::move(tap));
  });
}

}  // namespace

std::span<const BridgeRow> bridge_rows() noexcept {
  static const std::vector<BridgeRow> kRows = {
      {"spacenav",
       "the socket of spacenavd: SPNAV_SOCKET, `socket =` of /etc/spnavrc, /var/run/spnav.sock",
       make_spacenav},
      {"haply", "none; the service is reached by TCP", make_haply, replay_messages},
      {"openhaptics",
       "libHD.so.3.4, libHD.so.3 or libHD.so as the loader finds it; $GTDD_HOME/config/*.config",
       make_openhaptics, replay_frames},
      {"forcedimension", "libdhd.so.3, libdhd.so, libdrd.so.3 or libdrd.so as the loader finds it",
       make_forcedimension, replay_dhd},
      {"dynamixel", "/dev/serial/by-id/*; the arm's URDF", make_dynamixel},
      {"feetech", "/dev/serial/by-id/*; the arm's URDF", make_feetech}};
  return kRows;
}

}  // namespace haptic::tools
