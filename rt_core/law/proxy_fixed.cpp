// SPDX-License-Identifier: Apache-2.0
// The proxy of a part that never turns: planes keep their normals, so a row is exact wherever it
// was made and no contact region is needed for it.
#include <algorithm>
#include <cmath>

#include "rt_core/contact/fixed_obstacle.hpp"
#include "rt_core/law/proxy_step.hpp"

namespace haptic {

/// Nearest plane of a pair at p_: the certificate, which does not depend on the way to p_.
void Proxy::search_fixed(ProxyPair& pair, ProxyTick& tick) noexcept {
  const NearestPlane nearest = nearest_fixed_plane(*pair.view, p_.x0_w - pair.reference_w);
  tick.full_searches += 1;
  tick.search_work += pair.view->fixed->bounding_count;
  pair.plane = fixed_plane_id(nearest.number);
  pair.gap_m = nearest.gap_m;
  pair.gap_version = version_;
  pair.known = true;
  pair.inside = pair.gap_m < -valid_depth(parameters_.scale);
}

/// The one row of a plane, n.dx >= -gap about p; with friction its four generators, as add_row has
/// them.
bool Proxy::add_fixed_row(std::uint32_t imposed, const PlaneGap& gap, const Step& at,
                          const PoseError& error) noexcept {
  const ProxyScale& scale = parameters_.scale;
  const ImposedPlane& plane = imposed_[imposed];
  const ProxyPair& pair = pairs_[plane.pair];
  const Real mu = kSceneTraits.friction ? pair.friction : 0;
  const Real most = scale.tolerance_m + (pair.inside ? scale.recovery_step_m : Real{0});
  const auto add = [&](const Vec3& w) {
    const Real least = std::min(w.dot(at.dx_m) - gap.gap_m - plane.allowed_m, most);
    QpRow row;
    row.g.head<3>() = w;
    row.h = least - w.dot(error.translation_m);
    const std::uint32_t index = rows_.size();
    if (index >= (mu > 0 ? kMaxQpRows : kMaxProxyRows) || !rows_.push(row)) return false;
    row_plane_[index] = static_cast<std::uint8_t>(imposed);
    return true;
  };
  const Vec3& n = gap.normal_w;
  if (!(mu > 0)) return add(n);
  Vec3 t = error.translation_m - n * n.dot(error.translation_m);
  const Real pull = std::sqrt(t.squaredNorm());
  t = pull > scale.still_m ? Vec3(t / pull) : plane_basis(n).e1;
  const Vec3 b = n.cross(t);
  return add(n + mu * t) && add(n - mu * t) && add(n + mu * b) && add(n - mu * b);
}

}  // namespace haptic
