// SPDX-License-Identifier: Apache-2.0
#include "tools/bridges/bridge_table.hpp"

#include <vector>

#include "tools/bridges/dynamixel/dynamixel_device.hpp"
#include "tools/bridges/feetech/feetech_device.hpp"
#include "tools/bridges/forcedimension/forcedimension_device.hpp"
#include "tools/bridges/haply/haply_device.hpp"
#include "tools/bridges/openhaptics/openhaptics_device.hpp"
#include "tools/bridges/spacenav/spacenav_device.hpp"

namespace haptic::tools {

std::span<const BridgeRow> bridge_rows() noexcept {
  static const std::vector<BridgeRow> kRows = {
      {"spacenav", make_spacenav},       {"haply", make_haply},
      {"openhaptics", make_openhaptics}, {"forcedimension", make_forcedimension},
      {"dynamixel", make_dynamixel},     {"feetech", make_feetech}};
  return kRows;
}

}  // namespace haptic::tools
