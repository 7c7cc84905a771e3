// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The certificates of a verdict, checked in long double from the vertices alone. A verdict needs
/// no trust in what found it: a direction with a gap over all vertices separates two convex pieces;
/// a point in a tetrahedron of points of the C-obstacle lies in the C-obstacle (method
/// section 7.3). Nothing of rt_core/contact is used.

#include <array>
#include <cstdint>

#include "host_sim/oracle/placed_pair.hpp"

namespace haptic::sim {

/// Slack of a barycentric coordinate per unit of the tetrahedron's conditioning: 18 roundings of
/// the tested arithmetic, 4e-15 in double. The core allows its own rounding 16.
[[nodiscard]] Wide certificate_slack_of_real();
/// Whatever the conditioning, no coordinate may be out by more than this.
[[nodiscard]] Wide largest_certificate_slack_of_real();

/// Vertices of A and B whose differences b - R a are the three corners.
struct PortalVertices {
  std::array<std::uint32_t, 3> a{}, b{};
};

/// x in the tetrahedron of c and the three points.
struct CollisionCertificate {
  /// How far the worst coordinate leaves its range: l_k >= 0, sum l_k <= 1. <= 0: strictly inside.
  /// Infinite for points that span no volume or vertices that do not exist.
  Wide excess = 0;
  /// certificate slack times s^3 / |det|, s the largest distance from c, det six times the volume:
  /// what rounding of the corners by one part in 1e16 moves the coordinates by; never more than
  /// largest_certificate_slack_of_real().
  Wide slack = 0;
  /// The distance that the excess stands for [m]: x moved by so much is in the tetrahedron.
  Wide excess_m = 0;

  [[nodiscard]] bool holds() const { return excess <= slack; }
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

  /// Rounding of a gap in the tested arithmetic: 64 roundings of the largest coordinate about B's
  /// reference [m].
  [[nodiscard]] Wide rounding_m(const OraclePose& pose) const;

 private:
  const OraclePiece& a_;
  const OraclePiece& b_;
  WideVec mean_a_, mean_b_;
  Wide reach_ = 0;  ///< largest |a| plus largest |b|
};

}  // namespace haptic::sim
