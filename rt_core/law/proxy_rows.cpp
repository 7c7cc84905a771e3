// SPDX-License-Identifier: Apache-2.0
// Rows of the proxy's program: of a plane, one for each corner of its contact region.
#include <algorithm>
#include <array>

#include "rt_core/law/proxy_step.hpp"

namespace haptic {

PlaneGap Proxy::gap_at(const ProxyPair& pair, const Step& at, const PlaneId& id,
                       SupportPair support, ProxyTick& tick) const noexcept {
  tick.plane_gaps += 1;
  return plane_gap(*pair.view, at.q.r_wa, Vec3(at.q.x0_w - pair.reference_w), id, support);
}

/// Rows of a plane at a configuration; `support_too`: and at its support vertices.
bool Proxy::add_rows(std::uint32_t imposed, const Step& at, const PoseError& error,
                     bool support_too, ProxyTick& tick) noexcept {
  const ImposedPlane& plane = imposed_[imposed];
  const PlaneGap gap = gap_at(pairs_[plane.pair], at, plane.id, plane.support, tick);
  if (!gap.defined) return true;  // edges turned parallel: another plane will come
  return add_region(imposed, gap, at, error, support_too);
}

/// Rows of the contact region along a plane.
bool Proxy::add_region(std::uint32_t imposed, const PlaneGap& gap, const Step& at,
                       const PoseError& error, bool support_too) noexcept {
  ImposedPlane& plane = imposed_[imposed];
  plane.support = gap.support;
  if (is_fixed()) return add_row(imposed, {Vec3::Zero(), gap.gap_m}, gap.normal_w, at, error);
  const ProxyPair& pair = pairs_[plane.pair];
  const Vec3 y_w = at.q.x0_w - pair.reference_w;
  std::array<ManifoldPoint, kMaxManifoldPoints> points;
  const std::uint32_t count = contact_manifold(
      *pair.view, at.q.r_wa, y_w, gap, parameters_.scale.manifold_m, manifold_scratch_, points);
  for (std::uint32_t k = 0; k < count; ++k) {
    if (!add_row(imposed, points[k], gap.normal_w, at, error)) return false;
  }
  if (!support_too) return true;
  return add_row(imposed, support_row_point(*pair.view, at.q.r_wa, y_w, gap), gap.normal_w, at,
                 error);
}

/// Row n.(dx + dtheta x arm) >= -gap about p, where `at` tells where it was linearised; with
/// friction the point gets its cone.
bool Proxy::add_row(std::uint32_t imposed, const ManifoldPoint& point, const Vec3& normal_w,
                    const Step& at, const PoseError& error) noexcept {
  const ProxyScale& scale = parameters_.scale;
  const ImposedPlane& plane = imposed_[imposed];
  const ProxyPair& pair = pairs_[plane.pair];
  // Rows that zero motion would violate by more than this could be inconsistent.
  const Real most = pair.inside ? scale.tolerance_m + scale.recovery_step_m : close_m_;
  Real along = normal_w.dot(at.dx_m);
  if (!is_fixed()) along += point.app_w.cross(normal_w).dot(at.dtheta_rad);
  const Real least = std::min(along - point.gap_m - plane.allowed_m, most);
  if (rubs(pair)) return add_cone(imposed, point.app_w, normal_w, least, error);
  return push_row(imposed, point.app_w, normal_w, least, error, kMaxProxyRows);
}

/// Row w.(dx + dtheta x App) >= least about p.
bool Proxy::push_row(std::uint32_t imposed, const Vec3& app_w, const Vec3& w, Real least_m,
                     const PoseError& error, std::uint32_t most_rows) noexcept {
  QpRow row;
  Real pull = w.dot(error.translation_m);
  row.g.head<3>() = w;
  if (!is_fixed()) {
    const Vec3 moment = app_w.cross(w);
    row.g.tail<3>() = moment / secant_.length_m;
    pull += moment.dot(error.rotation_rad);
  }
  row.h = least_m - pull;
  const std::uint32_t index = rows_.size();
  if (index >= most_rows || !rows_.push(row)) return false;
  row_plane_[index] = static_cast<std::uint8_t>(imposed);
  if (!row_cone_.empty()) row_cone_[index] = kMaxFrictionCones;
  return true;
}

}  // namespace haptic
