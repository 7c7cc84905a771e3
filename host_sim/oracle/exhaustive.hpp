// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Exhaustive search over all basic contacts of a pair in long double (rt_core/METHOD.md sections 2
/// and 6).

#include <cstdint>
#include <vector>

#include "host_sim/oracle/placed_pair.hpp"

namespace haptic::sim {

/// Every node of the pair whose normal exists (type C: sine of the edges' angle at least 1e-15),
/// ascending by node. Cost: O(nodes times the vertices of the two features).
[[nodiscard]] std::vector<NodeValue> all_nodes(const OraclePiece& a, const OraclePiece& b,
                                               const OraclePose& pose);

/// Largest of n.(x-c)/(h(n)-n.c) over `applicable` , c = vertex mean of B minus R times that of A
/// (rt_core/METHOD.md section 7.2). `pose` as given to all_nodes. Dimensionless; at most 1: the
/// bodies meet.
[[nodiscard]] Wide largest_ratio(const OraclePiece& a, const OraclePiece& b, const OraclePose& pose,
                                 const std::vector<NodeValue>& nodes, Wide violation_tolerance_m);

/// How coarse the arithmetic under test is.
struct Precision {
  Wide unit_roundoff = 0;  ///< distance from 1 to the next number of its scalar
  /// s_min of rt_core/METHOD.md section 11: outside, type C may be left out below it.
  Wide optional_sine = 0;
  Wide parallel_sine = 0;   ///< edges with a smaller sine of their angle carry no type C node
  Wide relative_depth = 0;  ///< allowed error of D_near, in sizes
  /// Heights up to so many roundings of the size may be rounding to the tested arithmetic, which
  /// then counts a pair of edges by the gap along its normal.
  Wide height_roundings = 8;
  /// By how many roundings, over the sine, the value of one pair of edges may be off, in sizes.
  Wide value_roundings = 0;
};

[[nodiscard]] Precision precision_of_real();

/// What D_near of a pair must be.
///
/// `reference_m` is the largest s(n) = min over A of n.(x + R a) - max over B of n.b over the
/// normals of all faces and of all edge pairs that can be applicable. s(n) of any unit n is a lower
/// bound of the signed distance and every C-face normal is among them, so the sign of `reference_m`
/// is the verdict and inside it *is* D_near.
/// Outside, D_near (a plane value, not the distance) depends on which nearly parallel edge pairs
/// are applicable: it jumps from the face value to the edge-edge distance when exact parallelism is
/// left (rt_core/METHOD.md section 11), and the normal of such a pair turns by roundoff/sine along
/// its arc. `lower_m` counts only pairs that must count - sine above s_min, applicable by more than
/// rounding - less the change of their value; `upper_m` counts all that may, plus it. Elsewhere,
/// and always inside, lower = upper = reference.
struct PairTruth {
  Wide reference_m = 0;
  Wide lower_m = 0;
  Wide upper_m = 0;
};

/// Lets one edge pair raise the truth, which must start from all faces.
void count_edge_pair(const PlacedPair& placed, std::uint32_t edge_a, std::uint32_t edge_b,
                     Wide size_m, const Precision& precision, PairTruth& truth);

/// Cost: O(nF_A nV_B + nF_B nV_A + nE_A nE_B). No pruning but the sign test that defines
/// applicability.
[[nodiscard]] PairTruth search_pair(const OraclePiece& a, const OraclePiece& b,
                                    const OraclePose& pose, Wide size_m,
                                    const Precision& precision);

}  // namespace haptic::sim
