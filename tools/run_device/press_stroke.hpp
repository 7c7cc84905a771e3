// SPDX-License-Identifier: Apache-2.0
#pragma once
/// How far the simulated hand presses, so that the part meets what lies below it.

#include "tools/common/scene_bytes.hpp"
#include "tools/run_device/device_config.hpp"

namespace haptic::tools {

/// Straight down from where the part begins: 30 mm, or 10 mm farther than where it touches first;
/// 30 mm where it touches nothing within 300 mm. All at the device [m]. Cost: a tick for each half
/// millimetre. Not for the servo loop.
[[nodiscard]] double press_stroke_m(const DeviceConfig& config, const SceneBytes& scene);

}  // namespace haptic::tools
