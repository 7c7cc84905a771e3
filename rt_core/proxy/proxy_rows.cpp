// SPDX-License-Identifier: Apache-2.0
// Rows of the proxy's program: of a plane, one for each corner of its contact region.
#include <algorithm>
#include <array>

#include "rt_core/proxy/proxy_step.hpp"

namespace haptic {

PlaneGap Proxy::gap_at(const ProxyPair& pair, const Step& at, const PlaneId& id,
                       SupportPair support, ProxyTick& tick) const noexcept {
  tick.work.plane_gaps += 1;
  return plane_gap(pair_at(pair, at.q), id, support);
}

/// The contact region along `region.gap`, at the configuration `at` where that is.
void Proxy::find_region(const ProxyPair& pair, const GripPose& at, PlaneRegion& region,
                        ProxyTick& tick) noexcept {
  region.overlap = true;
  region.count = 1;
  region.points[0] = {Vec3::Zero(), region.gap.gap_m};
  region.turn_w.setZero();
  if (!region.gap.defined) return;
  tick.work.regions += 1;
  const PairAt seen = pair_at(pair, at);
  region.count = contact_manifold(seen.view, seen.r_wa, seen.y_w, region.gap,
                                  parameters_.scale.manifold_m, scratch_.manifold, region.points);
  region.overlap = scratch_.manifold.overlap;
  if (!region.overlap) {
    region.turn_w = plane_turn(seen, region.gap);
  }
}

/// The contact region along a plane at p, from the last time it was asked for while p has stayed.
const PlaneRegion& Proxy::region_at_p(std::uint32_t index, const PlaneId& id, SupportPair support,
                                      ProxyTick& tick) noexcept {
  for (const PlaneRegion& kept : part_.regions) {
    if (kept.version == part_.version && kept.pair == index && kept.gap.id == id) return kept;
  }
  PlaneRegion& region = part_.regions[part_.oldest_region];
  part_.oldest_region = (part_.oldest_region + 1) % kKeptRegions;
  ProxyPair& pair = near_.pairs[index];
  need_view(pair, tick);
  tick.work.plane_gaps += 1;
  region.pair = index;
  region.version = part_.version;
  region.gap = plane_gap(pair_at(pair, part_.pose), id, support);
  find_region(pair, part_.pose, region, tick);
  return region;
}

/// Rows of a plane at p.
bool Proxy::add_rows_at_p(std::uint32_t imposed, const PoseError& error, ProxyTick& tick) noexcept {
  const ImposedPlane& plane = program_.imposed[imposed];
  const PlaneRegion& region = region_at_p(plane.pair, plane.id, plane.support, tick);
  return !region.gap.defined || add_region(imposed, region, error);
}

/// Rows of a plane at a step; `support_too`: and at its support vertices.
bool Proxy::add_rows(std::uint32_t imposed, const Step& at, const PoseError& error,
                     bool support_too, ProxyTick& tick) noexcept {
  const ImposedPlane& plane = program_.imposed[imposed];
  const ProxyPair& pair = near_.pairs[plane.pair];
  PlaneRegion region;
  region.gap = gap_at(pair, at, plane.id, plane.support, tick);
  if (!region.gap.defined) return true;  // edges turned parallel: another plane will come
  if (!is_locked()) find_region(pair, at.q, region, tick);
  if (!add_region(imposed, region, error, &at)) return false;
  if (!support_too || is_locked()) return true;
  const PairAt seen = pair_at(pair, at.q);
  const ManifoldPoint point = support_row_point(seen, region.gap);
  const RowArm arm{point.app_w, plane_turn(seen, region.gap)};
  return add_row(imposed, arm, point.gap_m, region.gap.normal_w, &at, error);
}

/// Rows of the contact region along a plane; null `at`: of the region at p.
bool Proxy::add_region(std::uint32_t imposed, const PlaneRegion& region, const PoseError& error,
                       const Step* at) noexcept {
  program_.imposed[imposed].support = region.gap.support;
  if (is_locked()) {  // all points move alike: the lowest one says it all
    return add_row(imposed, RowArm{}, region.gap.gap_m, region.gap.normal_w, at, error);
  }
  for (std::uint32_t k = 0; k < region.count; ++k) {
    const ManifoldPoint& point = region.points[k];
    const RowArm arm{point.app_w, region.turn_w};
    if (!add_row(imposed, arm, point.gap_m, region.gap.normal_w, at, error)) return false;
  }
  return true;
}

/// Row n.(dx + dtheta x App) + turn.dtheta >= -gap about p, where `at` tells where it was
/// linearised, null: at p; with friction the point gets its cone.
bool Proxy::add_row(std::uint32_t imposed, const RowArm& arm, Real gap_m, const Vec3& normal_w,
                    const Step* at, const PoseError& error) noexcept {
  const ProxyPair& pair = near_.pairs[program_.imposed[imposed].pair];
  Real along = 0;
  if (at != nullptr) {
    along = normal_w.dot(at->dx_m);
    if (!is_locked()) along += turned_m(arm, normal_w, at->dtheta_rad);
  }
  // Rows that zero motion would violate by more than this could be inconsistent.
  const Real least = std::min(along - gap_m, program_.close_m);
  if (rubs(pair)) return add_cone(imposed, arm, normal_w, least, error);
  return push_row(imposed, arm, normal_w, least, error, kMaxProxyRows);
}

/// Row w.(dx + dtheta x App) + turn.dtheta >= least about p.
bool Proxy::push_row(std::uint32_t imposed, const RowArm& arm, const Vec3& w, Real least_m,
                     const PoseError& error, std::uint32_t most_rows) noexcept {
  QpRow row;
  Real pull = w.dot(error.translation_m);
  row.g.head<3>() = w;
  if (!is_locked()) {
    const Vec3 moment = arm.app_w.cross(w) + arm.turn_w;
    row.g.tail<3>() = moment / program_.secant.length_m;
    pull += moment.dot(error.rotation_rad);
  }
  row.h = least_m - pull;
  const std::uint32_t index = program_.rows.size();
  if (index >= most_rows || !program_.rows.push(row)) return false;
  program_.row_plane[index] = static_cast<std::uint8_t>(imposed);
  if (!program_.row_cone.empty()) program_.row_cone[index] = kMaxFrictionCones;
  return true;
}

}  // namespace haptic
