// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Vertices and faces of a shape under construction; not used outside this folder.

#include <cmath>
#include <cstdint>
#include <numbers>
#include <utility>
#include <vector>

#include "tools/graph_compiler/shapes/shape.hpp"

namespace haptic::tools {

using Loop = std::vector<std::uint32_t>;

class ShapeBuilder {
 public:
  std::uint32_t vertex(const Point3& p) {
    mesh_.vertices.push_back(p);
    return static_cast<std::uint32_t>(mesh_.vertices.size() - 1);
  }
  /// Counter-clockwise seen from outside.
  void face(Loop loop) { mesh_.faces.push_back({std::move(loop), 0, 0}); }
  [[nodiscard]] const Point3& at(std::uint32_t v) const { return mesh_.vertices[v]; }
  /// A regular polygon around the z axis, first corner on +x.
  Loop ring(double radius_m, double z_m, std::uint32_t corners);
  /// The strip between two rings of equal count; `upper` lies above or outside, faces look away
  /// from the axis.
  void strip(const Loop& lower, const Loop& upper);
  /// A triangle from each side of the ring to `apex`; with `up` the ring is seen counter-clockwise
  /// from outside.
  void fan(const Loop& ring, std::uint32_t apex, bool up);
  void flat(Loop ring, bool up);
  [[nodiscard]] RawMesh finish(const std::string& name);

 private:
  RawMesh mesh_;
};

/// cos and sin of step / count turns. Bits of mirrored angles are those of the mirrored numbers,
/// as far as the count allows.
std::pair<double, double> turn_direction(std::uint64_t step, std::uint32_t count);

/// cos(pi / segments): distance of the middle of a facet from the axis, by that of its corners.
inline double facet_share(std::uint32_t segments) { return std::cos(std::numbers::pi / segments); }

RawMesh thread_mesh(const ThreadShape& shape, const std::string& name);
RawMesh nut_mesh(const NutShape& shape, const std::string& name);
RawMesh bolt_mesh(const BoltShape& shape, const std::string& name);

}  // namespace haptic::tools
