// SPDX-License-Identifier: Apache-2.0
#pragma once
/// D_near of one pair and the normals that attain it, as `search_pair` has them, at a cost that
/// half a million nodes and ten thousands of poses allow: a search in double over every node, with
/// slack, names the candidates, and only those are evaluated in long double with full supports.

#include <cstdint>
#include <vector>

#include "host_sim/oracle/sifted_pair.hpp"

namespace haptic::sim {

/// Truth at one pose.
struct NearTruth {
  PairTruth truth;
  std::vector<WideVec> normals;  ///< outward C-face normals whose value is within kTie_m of D_near
};

class NearReference {
 public:
  NearReference(OraclePiece a, OraclePiece b);
  NearReference(const NearReference&) = delete;
  NearReference& operator=(const NearReference&) = delete;

  /// Truth with A at `pose`. Cost: as SiftedPair.
  [[nodiscard]] NearTruth at(const OraclePose& pose);

  [[nodiscard]] std::uint64_t node_count() const;

  static constexpr double kTie_m = 1e-9;

  /// How near to parallel edges may be, and to applicable: for methods in double, with either
  /// scalar of the core.
  [[nodiscard]] static Precision precision() { return {0x1p-52L, 1.5e-8L, 1e-12L, 1e-12L}; }

 private:
  OraclePiece a_, b_;
  SiftedPair sifted_;
};

}  // namespace haptic::sim
