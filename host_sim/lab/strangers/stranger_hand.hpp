// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The hand that puts a part in: it comes a little beside and tilted, searches, inserts, presses
/// beyond the end, wobbles and pulls out, with a tremor. Every 90 ms it stops dead for 12 ms: then
/// a force that changes was late.

#include <cstdint>
#include <string>
#include <vector>

#include "host_sim/lab/strangers/stranger_pair.hpp"
#include "host_sim/session/motion_script.hpp"

namespace haptic::sim {

inline constexpr std::size_t kTicksBetweenStops = 90, kTicksOfStop = 12;

struct HandMotion {
  std::vector<MotionSample> samples;  ///< at 1 kHz
  std::vector<std::string> phases;    ///< of every sample: "search"
  std::vector<std::size_t> stops;  ///< the first tick of each that has the pose of the one before
};

/// The whole way in and out, about 4 s.
[[nodiscard]] HandMotion insertion_motion(const StrangerPair& pair);
/// From the start 50 mm back along the way, round in the open, and back to the start: nothing is
/// there to be touched.
[[nodiscard]] HandMotion open_air_motion(const StrangerPair& pair);

}  // namespace haptic::sim
