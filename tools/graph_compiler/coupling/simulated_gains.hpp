// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A scene that names no device, on a device that is simulated: its gains are no larger than that
/// one and the delay of its loop hold, as if the scene had been compiled for it.

#include <optional>
#include <string>

#include "rt_core/scene/scene_format.hpp"

namespace haptic::tools {

/// The loop over a simulated device.
struct SimulatedLoop {
  DeviceParameters
      device{};           ///< mass_kg > 0; delay_s: all from a sample to the begin of its wrench
  double rate_hz = 1000;  ///< > 0: in place of the scene's
  bool turns = true;      ///< its rotor feels the torque; false: its grip holds every torque
};

/// Gains that are lower than the scene's.
struct SimulatedGains {
  double k_t_n_per_m = 0, k_r_nm_per_rad = 0;  ///< law proxy
  double damping_ns_per_m = 0;                 ///< law proxy
  double k_f_n_per_m = 0;                      ///< the other laws
  std::string text;  ///< a sentence: what the scene asks for, what is rendered, how to have it
                     ///< otherwise

  /// In place of the scene's.
  void put(SceneParameters& parameters) const;
};

/// Law proxy: k_t and k_r within the passivity budget of the device, and no more than half of what
/// its own damping holds, as derived gains are; the coupling's damping at half of what is safe
/// alone where it is not safe. Other laws: k_F within the budget. Nothing where the scene's gains
/// are no larger, where it has a [device] with a mass or allows active gains, or where the device
/// holds no gain at all. `radius_m` is r_A. Cost: some milliseconds.
[[nodiscard]] std::optional<SimulatedGains> simulated_gains(const SceneParameters& scene,
                                                            double radius_m,
                                                            const SimulatedLoop& loop);

}  // namespace haptic::tools
