// SPDX-License-Identifier: Apache-2.0
#pragma once
/// All bridges, one row each. Their keys are those of the row of the same name in
/// hal/drivers/driver_registry.hpp.

#include <memory>
#include <span>
#include <string_view>

#include "hal/bridge/bridged_device.hpp"
#include "hal/drivers/driver_registry.hpp"
#include "tools/bridges/record/replay.hpp"

namespace haptic::tools {

struct BridgeRow {
  std::string_view name;   ///< as `[device] driver` has it
  std::string_view files;  ///< and variables that it looks at, for the manual page
  /// Null, with `defect` filled, for values of keys that no device can be made of. Opens nothing.
  std::unique_ptr<hal::BridgedDevice> (*make)(const hal::DriverOptions& options,
                                              hal::DriverDefect& defect);
  /// Plays the rest of a recording to its code. `device` is of `make`, and is not open.
  ReplayResult (*replay)(Recording& recording, hal::BridgedDevice& device) = replay_calls;
};

[[nodiscard]] std::span<const BridgeRow> bridge_rows() noexcept;

}  // namespace haptic::tools
