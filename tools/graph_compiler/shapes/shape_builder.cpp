// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/shapes/shape_builder.hpp"

#include <algorithm>

namespace haptic::tools {

std::pair<double, double> turn_direction(std::uint64_t step, std::uint32_t count) {
  // Angle in units of 1 / (8 count) turns, folded into the first eighth by whole numbers.
  const std::uint64_t turn = 8ULL * count;
  std::uint64_t angle = 8 * (step % count);
  const bool below = 2 * angle > turn;
  if (below) angle = turn - angle;
  const bool left = 4 * angle > turn;
  if (left) angle = turn / 2 - angle;
  const bool steep = 8 * angle > turn;
  if (steep) angle = turn / 4 - angle;
  double c = 1.0, s = 0.0;
  if (8 * angle == turn) {
    c = s = std::numbers::sqrt2 / 2;
  } else if (angle > 0) {
    const double a =
        2.0 * std::numbers::pi * static_cast<double>(angle) / static_cast<double>(turn);
    c = std::cos(a);
    s = std::sin(a);
  }
  if (steep) std::swap(c, s);
  return {left ? -c : c, below ? -s : s};
}

Loop ShapeBuilder::ring(double radius_m, double z_m, std::uint32_t corners) {
  Loop loop;
  for (std::uint32_t k = 0; k < corners; ++k) {
    const auto [c, s] = turn_direction(k, corners);
    loop.push_back(vertex({radius_m * c, radius_m * s, z_m}));
  }
  return loop;
}

void ShapeBuilder::strip(const Loop& lower, const Loop& upper) {
  for (std::size_t k = 0; k < lower.size(); ++k) {
    const std::size_t next = (k + 1) % lower.size();
    face({lower[k], lower[next], upper[next], upper[k]});
  }
}

void ShapeBuilder::fan(const Loop& ring, std::uint32_t apex, bool up) {
  for (std::size_t k = 0; k < ring.size(); ++k) {
    const std::uint32_t a = ring[k], b = ring[(k + 1) % ring.size()];
    face(up ? Loop{a, b, apex} : Loop{b, a, apex});
  }
}

void ShapeBuilder::flat(Loop ring, bool up) {
  if (!up) std::reverse(ring.begin(), ring.end());
  face(std::move(ring));
}

RawMesh ShapeBuilder::finish(const std::string& name) {
  mesh_.file = name;
  mesh_.indexed = true;
  mesh_.vertex_places.assign(mesh_.vertices.size(), 0);
  return std::move(mesh_);
}

}  // namespace haptic::tools
