// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The same path felt in two divisions of the same bodies: the difference of the wrench tick by
/// tick, and how strong the wrench is compared with the paper's.

#include "host_sim/shapes/hole_divisions.hpp"

namespace haptic::sim {

/// Wrenches that differ by more than this count as different, and a force above it as a contact.
inline constexpr double kFeltDifference_n = 0.01;

/// Differences |dW| = sqrt(|dF|^2 + |dtau|^2 k_t / k_r): torques at the lever at which both springs
/// are equally stiff [N].
struct DivisionDifference {
  std::string division;           ///< compared with the first one
  std::vector<double> by_tick_n;  ///< along the path
  std::vector<double> sorted_n;   ///< the same, ascending
  double worst_gap_m = 0;         ///< of the proxy in this division
  /// Share of ticks that differ by more than two minima of one contact may: depth that counts as
  /// free, t, lets each lie |F| t above the least energy, and so sqrt(2 k_t |F| t) of wrench away
  /// where the contact leaves a freedom. The part beyond rests on another contact.
  double other_contact_share = 0;
  [[nodiscard]] double quantile_n(double share) const;
  /// Share of ticks in which the wrenches differ by more than `limit_n`.
  [[nodiscard]] double share_over(double limit_n) const;
};

struct DivisionComparison {
  std::vector<DivisionDifference> differences;  ///< law proxy
  std::vector<DivisionDifference> paper;        ///< the paper's law, on the same paths
  double tolerance_n = 0;  ///< k_t times the depth that counts as free in this scene
  /// Mean force in the first division over the ticks of the path in which both laws push by more
  /// than kFeltDifference_n and less than 45 degrees apart: there they render the same contact. The
  /// paper's law goes through a rim on which the proxy still stands.
  double proxy_mean_n = 0, paper_mean_n = 0;
  std::size_t contact_ticks = 0;  ///< those ticks
  std::size_t pushed_ticks = 0;   ///< in which both push, whichever way
  std::size_t ticks = 0;          ///< of the path

  /// Whether the proxy's mean force lies within 20 % of the paper's, and both push.
  [[nodiscard]] bool same_strength() const;
};

/// Share of ticks that may differ by more than kFeltDifference_n, none of faces; when jammed, that
/// may rest on another contact.
[[nodiscard]] double most_felt_share(DivisionContact contact);
/// Whether a difference keeps what is asked of the contact: faces within twice `tolerance_n` in
/// every tick, as each of the two is within it; others at the 99th percentile while nothing is
/// jammed or released, and by share.
[[nodiscard]] bool agrees(const DivisionDifference& difference, DivisionContact contact,
                          double tolerance_n);

/// |dW| between two wrenches under the coupling of `scene` [N].
[[nodiscard]] double wrench_distance_n(const CoupledScene& scene, const TraceTick& a,
                                       const TraceTick& b);
/// Differences between two traces of the same path.
[[nodiscard]] DivisionDifference difference_between(const CoupledScene& scene, const Trace& a,
                                                    const Trace& b);
/// Distance of the farthest vertex from the body's origin [m].
[[nodiscard]] double farthest_m(const tools::Body& body);
/// Depth that counts as free, as the core derives it from part and scene [m].
[[nodiscard]] double free_depth_m(const CoupledScene& scene);

/// Runs every division under law proxy and under the paper's.
/// Cost: about 10 us per tick and division.
[[nodiscard]] DivisionComparison compare_divisions(const DivisionCase& contact);

}  // namespace haptic::sim
