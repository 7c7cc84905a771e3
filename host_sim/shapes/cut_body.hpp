// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Convex bodies cut into pieces that share their planes: both sides of a cut name the same stored
/// plane, and what was one face stays in one plane. A contact on it must not feel the cut.

#include <cstdint>
#include <span>

#include "host_sim/shapes/shapes.hpp"

namespace haptic::sim {

/// Plane n.x = offset in the body frame, n of unit length.
struct CutPlane {
  Vector normal = Vector::UnitX();
  double offset_m = 0;
};

/// Every piece that `plane` crosses becomes two; the others stay. New vertices are rounded to
/// double once and are the same on both sides. Vertices within 1e-12 m of the plane count as on it.
[[nodiscard]] tools::Body cut_body(const tools::Body& body, const CutPlane& plane);

/// `body` cut by each of the planes in turn.
[[nodiscard]] tools::Body cut_body(const tools::Body& body, std::span<const CutPlane> planes);

/// `body` cut by planes of random direction through random points of the box `half` about the
/// origin, until one more would make more than `most_pieces`; at most four planes.
[[nodiscard]] tools::Body random_cuts(const tools::Body& body, const Vector& half,
                                      std::uint32_t most_pieces, Seeded& random);

/// The same pieces in another order: `order` names each once.
[[nodiscard]] tools::Body reordered(const tools::Body& body, std::span<const std::uint32_t> order);

}  // namespace haptic::sim
