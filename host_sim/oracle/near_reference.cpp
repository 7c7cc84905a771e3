// SPDX-License-Identifier: Apache-2.0
#include "host_sim/oracle/near_reference.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace haptic::sim {

NearReference::NearReference(OraclePiece a, OraclePiece b)
    : a_(std::move(a)),
      b_(std::move(b)),
      sifted_(a_, b_, std::max(diameter(a_.vertices), diameter(b_.vertices))) {}

std::uint64_t NearReference::node_count() const {
  return std::uint64_t{a_.loops.size()} * b_.vertices.size() +
         std::uint64_t{a_.vertices.size()} * b_.loops.size() +
         std::uint64_t{a_.edges.size()} * b_.edges.size();
}

NearTruth NearReference::at(const OraclePose& pose) {
  const Wide tie = widen(kTie_m);
  NearTruth result;
  result.truth = sifted_.search(pose, precision());
  const Wide d = result.truth.reference_m;
  for (const NodeValue& node :
       sifted_.near_candidates(pose, d, tie, 0, precision().parallel_sine)) {
    if (std::abs(node.depth_m - d) + std::max(node.violation_m, 0.0L) < tie) {
      result.normals.push_back(node.normal);
    }
  }
  return result;
}

}  // namespace haptic::sim
