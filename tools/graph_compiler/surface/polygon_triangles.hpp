// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A face of any number of corners as triangles over its own corners.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "tools/graph_compiler/mesh/surface.hpp"

namespace haptic::tools {

/// Cuts a loop into loop.size() - 2 triangles, appended to `out`: every side of the loop is a side
/// of one of them, also where the loop is bent or crosses itself. Ears are cut off, seen along the
/// area vector of the loop; where none is left (the loop is not simple) any corner is. Straight
/// corners go last, so that triangles without area are made only where there is no choice.
/// Cost: corners times reflex corners.
void triangulate_loop(const std::vector<Point3>& points, std::span<const std::uint32_t> loop,
                      std::vector<std::array<std::uint32_t, 3>>& out);

}  // namespace haptic::tools
