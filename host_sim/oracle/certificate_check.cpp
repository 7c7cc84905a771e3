// SPDX-License-Identifier: Apache-2.0
#include "host_sim/oracle/certificate_check.hpp"

#include <algorithm>
#include <limits>

namespace haptic::sim {
namespace {

constexpr Wide kInfinity = std::numeric_limits<Wide>::infinity();

WideVec mean_of(const std::vector<WideVec>& points) {
  WideVec sum;
  for (const WideVec& p : points) sum = sum + p;
  return (1.0L / static_cast<Wide>(points.size())) * sum;
}

Wide largest_norm(const std::vector<WideVec>& points) {
  Wide largest = 0;
  for (const WideVec& p : points) largest = std::max(largest, dot(p, p));
  return std::sqrt(largest);
}

/// A vector of W in A's axes.
WideVec turned_back(const WideRotation& r, const WideVec& v) {
  return v.x * r.row[0] + v.y * r.row[1] + v.z * r.row[2];
}

}  // namespace

Wide certificate_slack_of_real() { return 18 * widen(std::numeric_limits<Real>::epsilon()); }

Wide largest_certificate_slack_of_real() { return sizeof(Real) == sizeof(double) ? 1e-12L : 1e-4L; }

CertificateCheck::CertificateCheck(const OraclePiece& a, const OraclePiece& b)
    : a_(a),
      b_(b),
      mean_a_(mean_of(a.vertices)),
      mean_b_(mean_of(b.vertices)),
      reach_(largest_norm(a.vertices) + largest_norm(b.vertices)) {}

Wide CertificateCheck::gap_m(const OraclePose& pose, const WideVec& n) const {
  const Wide length = norm(n);
  if (!(length > 0) || !(length < kInfinity)) return -kInfinity;
  const WideVec n_w = (1.0L / length) * n;
  const WideVec n_a = turned_back(pose.r, n_w);
  Wide low_a = kInfinity, high_b = -kInfinity;
  for (const WideVec& v : a_.vertices) low_a = std::min(low_a, dot(n_a, v));
  for (const WideVec& v : b_.vertices) high_b = std::max(high_b, dot(n_w, v));
  return dot(n_w, pose.x) + low_a - high_b;
}

CollisionCertificate CertificateCheck::collision(const OraclePose& pose,
                                                 const PortalVertices& portal) const {
  CollisionCertificate result{kInfinity, 0, kInfinity};
  const WideVec c = mean_b_ - pose.r * mean_a_;
  const WideVec x = pose.x - c;
  WideVec v[3];
  Wide s = norm(x);
  for (std::size_t k = 0; k < 3; ++k) {
    if (portal.a[k] >= a_.vertices.size() || portal.b[k] >= b_.vertices.size()) return result;
    v[k] = (b_.vertices[portal.b[k]] - pose.r * a_.vertices[portal.a[k]]) - c;
    s = std::max(s, norm(v[k]));
  }
  const Wide det = dot(v[0], cross(v[1], v[2]));
  if (!(std::abs(det) > 0)) return result;
  const Wide l0 = dot(x, cross(v[1], v[2])) / det;
  const Wide l1 = dot(x, cross(v[2], v[0])) / det;
  const Wide l2 = dot(x, cross(v[0], v[1])) / det;
  result.excess = std::max({-l0, -l1, -l2, (l0 + l1 + l2) - 1});
  const Wide conditioning = s * s * s / std::abs(det);
  result.slack = std::min(certificate_slack_of_real() * std::max(conditioning, 1.0L),
                          largest_certificate_slack_of_real());
  // Lifting a coordinate to zero moves x by no more than that coordinate times its corner.
  result.excess_m = 3 * std::max(result.excess, 0.0L) * s;
  return result;
}

WideVec CertificateCheck::between_centres(const OraclePose& pose) const {
  return (pose.x + pose.r * mean_a_) - mean_b_;
}

Wide CertificateCheck::rounding_m(const OraclePose& pose) const {
  return 64 * widen(std::numeric_limits<Real>::epsilon()) * (reach_ + norm(pose.x));
}

}  // namespace haptic::sim
