// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Fig. 2 of the paper: four instants of a motion in physical space and in C-space, with the near
/// C-face lit, and the sequence of near nodes that the core reports on the way.

#include <array>
#include <cstdint>
#include <vector>

#include "host_sim/session/motion_script.hpp"
#include "host_sim/report/part_report.hpp"

namespace haptic::sim {

/// A motion of the tetrahedron over four C-faces of the box's C-obstacle, from each to a neighbor
/// of it.
struct FaceWalk {
  std::vector<MotionSample> motion;       ///< 1 kHz
  std::array<std::size_t, 4> instants{};  ///< ticks at which x_0 stands over the middle of a C-face
  std::vector<std::uint32_t> sequence;  ///< the near node whenever it is a single one, changes only
  std::uint32_t relocalised = 0;        ///< ticks after the first that needed a second search
};

/// The nodes of the walk: types B, C, A, C, each a G-neighbor of the one before.
inline constexpr std::array<std::uint32_t, 4> kWalkNodes = {44, 124, 27, 113};

[[nodiscard]] FaceWalk make_face_walk();

[[nodiscard]] PartReport motion_part();

}  // namespace haptic::sim
