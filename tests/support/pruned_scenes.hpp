// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Marks for test scenes by rules of their own, simpler and wider than the compiler's.

#include <array>
#include <vector>

#include "tests/support/shapes.hpp"

namespace haptic::test {

/// Marks without any node missing, by pair of the unpruned scene.
std::vector<tools::PairMarks> all_marks(const SceneView& view);

/// Clears `reachable` of nodes that no orientation within `max_angle_rad` of `q_wa` (x, y, z, w)
/// makes applicable: each edge at a vertex taken by itself, the arc of an edge as a cap about its
/// middle. Keeps more than is needed.
void mark_envelope(const SceneView& view, const std::array<double, 4>& q_wa, double max_angle_rad,
                   std::vector<tools::PairMarks>& marks);

/// Clears `exposed` of the nodes of a body's cut features: faces, edges and vertices with a face in
/// a plane that is not one of the planes of `uncut` (a convex body in the same frame).
void mark_cuts(const SceneView& view, std::uint32_t body, const tools::Body& uncut,
               std::vector<tools::PairMarks>& marks);

/// The description with an envelope and its marks.
tools::SceneDescription with_envelope(tools::SceneDescription description,
                                      const std::array<double, 4>& q_wa, double max_angle_rad);

/// A box as several: those between the cuts along x; for each slab its own cuts along y.
tools::Body cut_box(const Point& lo, const Point& hi, const std::vector<double>& cuts_x,
                    const std::vector<std::vector<double>>& cuts_y);

}  // namespace haptic::test
