// SPDX-License-Identifier: Apache-2.0
#pragma once
/// How far the hands of simulated devices go until they press.

#include <array>
#include <vector>

#include "tools/common/scene_bytes.hpp"
#include "tools/run_device/device_config.hpp"

namespace haptic::tools {

/// By device, from where the part begins, in D at the device [m]. One hand goes straight down, two
/// towards each other: 30 mm, or 10 mm farther than where a part touches first; 30 mm where none
/// touches anything within 300 mm. Not for the servo loop: a tick for each half millimetre.
[[nodiscard]] std::vector<std::array<double, 3>> press_strokes_m(const DeviceConfig& config,
                                                                 const SceneBytes& scene);

}  // namespace haptic::tools
