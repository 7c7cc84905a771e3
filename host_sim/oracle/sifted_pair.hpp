// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The exhaustive search for pairs of many nodes: every face and every pair of edges is looked at
/// in double, with margins far above its rounding, and what passes is evaluated in long double by
/// the definition. Gives what search_pair and all_nodes give, in a tenth of their time.

#include <cstdint>
#include <vector>

#include "host_sim/oracle/exhaustive.hpp"

namespace haptic::sim {

/// Points or directions as three arrays.
struct Columns {
  std::vector<double> x, y, z;

  explicit Columns(std::size_t count = 0) : x(count), y(count), z(count) {}
  [[nodiscard]] std::size_t size() const { return x.size(); }
  void set(std::size_t k, const WideVec& v) {
    x[k] = static_cast<double>(v.x);
    y[k] = static_cast<double>(v.y);
    z[k] = static_cast<double>(v.z);
  }
};

class SiftedPair {
 public:
  /// The pieces must outlive it. `size_m`: the scale of rounding, a diameter.
  SiftedPair(const OraclePiece& a, const OraclePiece& b, Wide size_m);

  /// As search_pair. Cost: as search_pair in double, and long double for a few.
  [[nodiscard]] PairTruth search(const OraclePose& pose, const Precision& precision);

  /// Every node with |f - d| + max(violation, 0) < epsilon + margin, and some others, evaluated in
  /// long double; type A, then B, then C. Type C with a sine below `least_sine` is left out.
  [[nodiscard]] std::vector<NodeValue> near_candidates(const OraclePose& pose, Wide d_m,
                                                       Wide epsilon_m, Wide margin_m,
                                                       Wide least_sine);

 private:
  struct EdgePair {
    std::uint32_t a = 0, b = 0;
    bool plus = false, minus = false;  ///< signs of u x v that may be the outward normal
  };
  struct CrossedEdges {
    double sine = 0;
    double f_m = 0;     ///< with the normal u x v; of little worth when the sine is small
    double blur_m = 0;  ///< more than the rounding of f_m
  };
  [[nodiscard]] CrossedEdges cross_edges(const EdgePair& pair) const;
  /// Upper bound of the pair's value.
  [[nodiscard]] double highest_value(const EdgePair& pair, double margin_m) const;
  void place(const PlacedPair& placed);
  /// Heights of all apexes over the planes of edge `e` of A and every edge of B, times the sine;
  /// appends the pairs whose violation, times the sine, is at most `height_m`.
  void sift_edges(std::uint32_t e, double height_m);

  const OraclePiece& a_;
  const OraclePiece& b_;
  Wide size_m_;
  Columns va_, na_;  ///< placed
  Columns vb_, nb_;
  Columns direction_a_, rise_a_[2];  ///< unit u; u x (apex - a0), placed
  Columns direction_b_, rise_b_[2];  ///< unit v; v x (apex - b0)
  std::vector<double> low_, high_;   ///< of one edge of A, by edge of B
  std::vector<EdgePair> pairs_;
};

}  // namespace haptic::sim
