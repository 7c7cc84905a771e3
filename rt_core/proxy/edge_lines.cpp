// SPDX-License-Identifier: Apache-2.0
#include "rt_core/proxy/edge_lines.hpp"

#include <algorithm>

namespace haptic {

Vec3 line_between_edges_m(const PairView& pair, const Mat3& r_wa, const Vec3& y_w, std::uint32_t i,
                          std::uint32_t j) noexcept {
  const PieceView &a = pair.a, &b = pair.b;
  const Vec3 a0_w = r_wa * a.vertex(a.edges[i].vertex[0]) + y_w;
  const Vec3 u = r_wa * a.vertex(a.edges[i].vertex[1]) + y_w - a0_w;
  const Vec3 b0_w = b.vertex(b.edges[j].vertex[0]);
  const Vec3 v = b.vertex(b.edges[j].vertex[1]) - b0_w;
  // Nearest points a0 + s u and b0 + t v: s and t between 0 and 1.
  const Vec3 w = a0_w - b0_w;
  const Real uu = u.squaredNorm(), vv = v.squaredNorm(), uv = u.dot(v);
  const Real uw = u.dot(w), vw = v.dot(w), across = uu * vv - uv * uv;
  const Real crossing = across > kRealEpsilon * uu * vv ? (uv * vw - vv * uw) / across : 0;
  const Real t =
      std::clamp((uv * std::clamp(crossing, Real{0}, Real{1}) + vw) / vv, Real{0}, Real{1});
  const Real s = std::clamp((uv * t - uw) / uu, Real{0}, Real{1});
  return w + s * u - t * v;
}

}  // namespace haptic
