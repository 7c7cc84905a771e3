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

/// 113 bits: a tetrahedron may be so flat, and its faces so thin, that even long double takes a
/// point inside for one outside.
__extension__ using Widest = __float128;

using WidestVec = Triple<Widest>;
WidestVec widest(const WideVec& v) {
  return {static_cast<Widest>(v.x), static_cast<Widest>(v.y), static_cast<Widest>(v.z)};
}
Widest determinant(const WidestVec& a, const WidestVec& b, const WidestVec& c) {
  return dot(a, cross(b, c));
}

/// Squared distance of p from a segment.
Widest to_segment2(const WidestVec& p, const WidestVec& from, const WidestVec& to) {
  const WidestVec along = to - from, w = p - from;
  const Widest length2 = dot(along, along);
  Widest t = length2 > 0 ? dot(w, along) / length2 : 0;
  t = t < 0 ? 0 : t > 1 ? 1 : t;
  const WidestVec away = w - t * along;
  return dot(away, away);
}

/// Squared distance of p from a triangle that may have no area.
Widest to_triangle2(const WidestVec& p, const WidestVec& a, const WidestVec& b,
                    const WidestVec& c) {
  const WidestVec n = cross(b - a, c - a);
  const Widest area2 = dot(n, n);
  const bool over = area2 > 0 && dot(n, cross(b - a, p - a)) >= 0 &&
                    dot(n, cross(c - b, p - b)) >= 0 && dot(n, cross(a - c, p - c)) >= 0;
  const Widest height = dot(n, p - a);
  if (over) return height * height / area2;
  return std::min({to_segment2(p, a, b), to_segment2(p, b, c), to_segment2(p, c, a)});
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
  const WidestVec origin, w = widest(x), w0 = widest(v[0]), w1 = widest(v[1]), w2 = widest(v[2]);
  const Widest det = determinant(w0, w1, w2);
  const Widest sign = det < 0 ? -1 : 1;  // Cramer's rule without the division
  const Widest l0 = sign * determinant(w, w1, w2);
  const Widest l1 = sign * determinant(w, w2, w0);
  const Widest l2 = sign * determinant(w, w0, w1);
  result.inside = det != 0 && l0 >= 0 && l1 >= 0 && l2 >= 0 && l0 + l1 + l2 <= sign * det;
  result.distance_m = 0;
  if (!result.inside) {
    const Widest nearest2 =
        std::min({to_triangle2(w, w0, w1, w2), to_triangle2(w, origin, w0, w1),
                  to_triangle2(w, origin, w1, w2), to_triangle2(w, origin, w2, w0)});
    result.distance_m = std::sqrt(static_cast<Wide>(nearest2));
  }
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
