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

Wide distance_to_segment(const WideVec& p, const WideVec& from, const WideVec& to) {
  const WideVec along = to - from, w = p - from;
  const Wide length2 = dot(along, along);
  const Wide t = length2 > 0 ? std::clamp(dot(w, along) / length2, 0.0L, 1.0L) : 0.0L;
  return norm(w - t * along);
}

/// Of a triangle that may have no area.
Wide distance_to_triangle(const WideVec& p, const WideVec& a, const WideVec& b, const WideVec& c) {
  const WideVec n = cross(b - a, c - a);
  const Wide area = norm(n);
  const bool over = area > 0 && dot(n, cross(b - a, p - a)) >= 0 &&
                    dot(n, cross(c - b, p - b)) >= 0 && dot(n, cross(a - c, p - c)) >= 0;
  if (over) return std::abs(dot(n, p - a)) / area;
  return std::min(
      {distance_to_segment(p, a, b), distance_to_segment(p, b, c), distance_to_segment(p, c, a)});
}

}  // namespace

Wide certificate_slack_of_real() { return 16 * widen(std::numeric_limits<Real>::epsilon()); }

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
  CollisionCertificate result{false, kInfinity, certificate_slack_of_real() * scale_m(pose)};
  const WideVec c = mean_b_ - pose.r * mean_a_;
  const WideVec x = pose.x - c;
  WideVec v[3];
  for (std::size_t k = 0; k < 3; ++k) {
    if (portal.a[k] >= a_.vertices.size() || portal.b[k] >= b_.vertices.size()) return result;
    v[k] = (b_.vertices[portal.b[k]] - pose.r * a_.vertices[portal.a[k]]) - c;
  }
  const Wide det = dot(v[0], cross(v[1], v[2]));
  const Wide sign = det < 0 ? -1 : 1;  // Cramer's rule without the division
  const Wide l0 = sign * dot(x, cross(v[1], v[2]));
  const Wide l1 = sign * dot(x, cross(v[2], v[0]));
  const Wide l2 = sign * dot(x, cross(v[0], v[1]));
  result.inside = det != 0 && l0 >= 0 && l1 >= 0 && l2 >= 0 && l0 + l1 + l2 <= sign * det;
  const WideVec origin;
  result.distance_m = result.inside ? 0
                                    : std::min({distance_to_triangle(x, v[0], v[1], v[2]),
                                                distance_to_triangle(x, origin, v[0], v[1]),
                                                distance_to_triangle(x, origin, v[1], v[2]),
                                                distance_to_triangle(x, origin, v[2], v[0])});
  return result;
}

WideVec CertificateCheck::between_centres(const OraclePose& pose) const {
  return (pose.x + pose.r * mean_a_) - mean_b_;
}

Wide CertificateCheck::scale_m(const OraclePose& pose) const { return reach_ + norm(pose.x); }

Wide CertificateCheck::rounding_m(const OraclePose& pose) const {
  return 64 * widen(std::numeric_limits<Real>::epsilon()) * scale_m(pose);
}

}  // namespace haptic::sim
