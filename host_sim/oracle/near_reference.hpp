// SPDX-License-Identifier: Apache-2.0
#pragma once
/// D_near of one pair and the normals that attain it, as `search_pair` has them, at a cost that
/// half a million nodes and ten thousands of poses allow: a search in double over every node, with
/// slack, names the candidates, and only those are evaluated in long double with full supports.

#include <array>
#include <cstdint>
#include <vector>

#include "host_sim/oracle/exhaustive.hpp"

namespace haptic::sim {

/// Truth at one pose.
struct NearTruth {
  PairTruth truth;
  std::vector<WideVec> normals;  ///< outward C-face normals whose value is within kTie_m of D_near
};

class NearReference {
 public:
  NearReference(OraclePiece a, OraclePiece b);

  /// Truth with A at `pose`. Cost: two dots for most edge pairs, plus about O(vertices) in long
  /// double for each candidate.
  [[nodiscard]] NearTruth at(const OraclePose& pose);

  [[nodiscard]] std::uint64_t node_count() const;

  static constexpr double kTie_m = 1e-9;

 private:
  using Point = std::array<double, 3>;
  struct Edge {
    Point vertex, along, normal[2];
  };
  [[nodiscard]] double face_values();
  void keep_edges(double face_value_m);

  OraclePiece a_, b_;
  Wide size_m_;
  std::vector<Point> va_local_, na_local_, va_, na_, vb_, nb_;
  std::vector<Edge> ea_, eb_;  ///< of A at the pose, of B
  std::vector<double> face_a_m_, face_b_m_;
  struct EdgePair {
    std::uint32_t a, b;
  };
  std::vector<EdgePair> kept_;
};

}  // namespace haptic::sim
