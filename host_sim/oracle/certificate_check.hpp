// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The certificates of a verdict, checked in long double from the vertices alone. A verdict needs
/// no trust in what found it: a direction with a gap over all vertices separates two convex pieces;
/// a point in a tetrahedron of points of the C-obstacle lies in the C-obstacle (rt_core/METHOD.md
/// section 7.3). Nothing of rt_core/contact is used.

#include <array>
#include <cstdint>

#include "host_sim/oracle/placed_pair.hpp"

namespace haptic::sim {

/// Slack of a collision certificate in parts of the largest coordinate: x may stand so far outside
/// the tetrahedron. 16 roundings of the tested arithmetic, 3.6e-15 in double: what the core allows
/// itself too.
[[nodiscard]] Wide certificate_slack_of_real();

/// Vertices of A and B whose differences b - R a are the three corners.
struct PortalVertices {
  std::array<std::uint32_t, 3> a{}, b{};
};

/// x in the tetrahedron of c and the three points, the C-obstacle's own.
struct CollisionCertificate {
  /// All four barycentric coordinates are 0 or more: x is inside, regardless of the tetrahedron's
  /// shape.
  bool inside = false;
  /// Distance of x from the tetrahedron, which may be flat [m]: 0 inside; infinite for vertices
  /// that do not exist.
  Wide distance_m = 0;
  Wide slack_m = 0;  ///< certificate_slack_of_real() times the largest coordinate

  [[nodiscard]] bool holds() const { return distance_m <= slack_m; }
};

class CertificateCheck {
 public:
  /// The pieces must outlive it.
  CertificateCheck(const OraclePiece& a, const OraclePiece& b);

  /// Gap along `n`, brought to unit length here: smallest n.(x + R a) over all vertices of A less
  /// the largest n.b over all of B [m]; -infinity when n is zero or not finite. Cost: one product
  /// per vertex.
  [[nodiscard]] Wide gap_m(const OraclePose& pose, const WideVec& n) const;

  [[nodiscard]] CollisionCertificate collision(const OraclePose& pose,
                                               const PortalVertices& portal) const;

  /// From the vertex mean of B to that of A at the pose: separates pieces whose spheres are apart.
  [[nodiscard]] WideVec between_centres(const OraclePose& pose) const;

  /// Largest coordinate that enters a gap: reach of both bodies and distance of their origins [m].
  [[nodiscard]] Wide scale_m(const OraclePose& pose) const;
  /// Rounding of a gap in the tested arithmetic: 64 roundings of that [m].
  [[nodiscard]] Wide rounding_m(const OraclePose& pose) const;

 private:
  const OraclePiece& a_;
  const OraclePiece& b_;
  WideVec mean_a_, mean_b_;
  Wide reach_ = 0;  ///< largest |a| plus largest |b|
};

}  // namespace haptic::sim
