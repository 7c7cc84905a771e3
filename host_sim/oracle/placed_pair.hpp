// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Two pieces at one pose in long double, and single basic contacts of theirs by the definition
/// (rt_core/METHOD.md section 2).

#include <cstdint>
#include <limits>
#include <vector>

#include "host_sim/oracle/oracle_piece.hpp"

namespace haptic::sim {

/// Where A stands relative to B: a point `a` of A (geometry frame) is at `x + r a` in B's geometry
/// frame.
struct OraclePose {
  WideRotation r;
  WideVec x;
};

/// One basic contact at one pose.
struct NodeValue {
  std::uint32_t node = 0;
  Wide depth_m = 0;  ///< f = n . (x + R a - b)
  Wide violation_m =
      0;  ///< largest height of a neighboring vertex over the contact plane; <= 0: applicable
  WideVec normal;  ///< outward unit normal of the C-face
  Wide sine = 1;   ///< type C: of the angle between the edges
};

/// Both bodies in B's frame at the pose. The pieces must outlive it.
struct PlacedPair {
  std::vector<WideVec> va, na;  ///< vertices and face normals of A
  const OraclePiece& a;
  const OraclePiece& b;

  PlacedPair(const OraclePiece& piece_a, const OraclePiece& piece_b, const OraclePose& pose);

  /// s(n) = min over A of n.a - max over B of n.b, with the offsets taken from `origin` to keep the
  /// digits.
  [[nodiscard]] Wide gap_along(const WideVec& n, const WideVec& origin) const;
  /// Gap along the outward normal of a face, taken about the face's own first vertex.
  [[nodiscard]] Wide gap_of_face_a(std::size_t face) const;
  [[nodiscard]] Wide gap_of_face_b(std::size_t face) const;
};

/// Basic contacts by their features. Cost: O(vertices of the features).
[[nodiscard]] NodeValue node_of_type_a(const PlacedPair& pair, std::uint32_t face,
                                       std::uint32_t vertex);
[[nodiscard]] NodeValue node_of_type_b(const PlacedPair& pair, std::uint32_t vertex,
                                       std::uint32_t face);
/// False: the edges are exactly parallel (sine below 1e-15), there is no such node.
[[nodiscard]] bool node_of_type_c(const PlacedPair& pair, std::uint32_t edge_a,
                                  std::uint32_t edge_b, NodeValue& node);

}  // namespace haptic::sim
