// SPDX-License-Identifier: Apache-2.0
#include "tools/bridges/bridge_table.hpp"

#include <vector>

namespace haptic::tools {

std::span<const BridgeRow> bridge_rows() noexcept {
  static const std::vector<BridgeRow> kRows = {};
  return kRows;
}

}  // namespace haptic::tools
