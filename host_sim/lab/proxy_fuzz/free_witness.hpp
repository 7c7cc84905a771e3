// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Whether two convex pieces are apart, from their vertices alone and in long double: a direction
/// along which there is a gap proves it, whoever found the direction. Directions come from the
/// normals of faces and the cross products of edges, the last one first; nothing of
/// rt_core/contact is used.

#include <cstdint>
#include <vector>

#include "host_sim/oracle/exhaustive.hpp"

namespace haptic::sim {

/// A direction from B to A and the gap along it: a lower bound of the signed distance.
struct FreeGap {
  Wide gap_m = -std::numeric_limits<Wide>::infinity();
  WideVec normal_w;
  std::uint32_t vertex_a = 0, vertex_b = 0;  ///< between which the gap is
};

class FreeWitness {
 public:
  /// The pieces must outlive it.
  FreeWitness(const OraclePiece& a, const OraclePiece& b);

  /// The first gap found of at least `wanted_m`; else the largest known. Climbs from the last
  /// direction over the features at its support vertices, then from every face.
  [[nodiscard]] FreeGap find(const OraclePose& pose, Wide wanted_m);
  /// The signed distance by every face and every pair of edges. Milliseconds for large pieces.
  [[nodiscard]] Wide exhaustive_m(const OraclePose& pose) const;
  /// Whether the spheres round the pieces are this far apart.
  [[nodiscard]] bool far(const OraclePose& pose, Wide distance_m) const;

  [[nodiscard]] const OraclePiece& piece_a() const { return a_; }
  [[nodiscard]] const OraclePiece& piece_b() const { return b_; }

 private:
  enum class Kind : std::uint8_t { kFaceA, kFaceB, kEdges };
  struct Direction {
    Kind kind = Kind::kFaceB;
    std::uint32_t i = 0, j = 0;
    Wide sign = 1;
  };
  struct Incidence {
    std::vector<std::vector<std::uint32_t>> faces, edges;  ///< by vertex
    WideVec centre;
    Wide radius_m = 0;
    explicit Incidence(const OraclePiece& piece);
  };
  [[nodiscard]] bool normal_of(const OraclePose& pose, const Direction& d, WideVec& normal) const;
  [[nodiscard]] FreeGap gap_along(const OraclePose& pose, const WideVec& normal) const;
  void consider(const OraclePose& pose, const Direction& d, Direction& best, FreeGap& gap) const;
  void climb(const OraclePose& pose, Wide wanted_m, Direction& best, FreeGap& gap) const;

  const OraclePiece& a_;
  const OraclePiece& b_;
  Incidence at_a_, at_b_;
  Wide size_m_;
  Direction last_;
};

}  // namespace haptic::sim
