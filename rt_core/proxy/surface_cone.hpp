// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Which contacts of a surface can carry force: those whose two features are, along the contact's
/// normal, the end of their own surface and not of the one facet alone. The same test tells flat
/// edges inside of a face, convex, reflex and open edges, and edges at which many facets meet.

#include "rt_core/contact/basic_contact.hpp"
#include "rt_core/scene/scene_view.hpp"

namespace haptic {

/// How far a direction of the surface may rise over the plane of a contact [rad]: what six digits
/// of a mesh file leave of flat faces, and what a step turns the part by.
inline constexpr Real kConeSlack = 2.0e-3_r;

/// True if no direction in which the surfaces of the two pieces go on from the features of a node
/// lies beyond its plane: `normal_w` is its unit normal, from B to A. True of pieces that are no
/// facets. Cost: the directions at a vertex, or at two edges.
[[nodiscard]] inline bool goes_on_behind(const PairView& pair, const Mat3& r_wa,
                                         const NodeFeatures& node, const Vec3& normal_w) noexcept {
  const auto below = [](const Vec3& n) {
    return [n](const auto& direction) { return n.dot(direction) <= kConeSlack; };
  };
  const auto of_a = [&] { return below(r_wa.transpose() * -normal_w); };
  switch (node.type) {
    case ContactType::kA:
      return (!pair.b.is_facet() || pair.b.all_at_vertex(node.j, below(normal_w))) &&
             (!pair.a.is_side(node.i) || pair.a.all_at_edge(pair.a.side_edge(node.i), of_a()));
    case ContactType::kB:
      return (!pair.a.is_facet() || pair.a.all_at_vertex(node.i, of_a())) &&
             (!pair.b.is_side(node.j) ||
              pair.b.all_at_edge(pair.b.side_edge(node.j), below(normal_w)));
    case ContactType::kC:
      break;
  }
  return (!pair.b.is_facet() || pair.b.all_at_edge(node.j, below(normal_w))) &&
         (!pair.a.is_facet() || pair.a.all_at_edge(node.i, of_a()));
}

}  // namespace haptic
