// SPDX-License-Identifier: Apache-2.0
// The proxy of a part that never turns: planes keep their normals, so a row is exact wherever it
// was made and no contact region is needed for it.
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

}  // namespace haptic
