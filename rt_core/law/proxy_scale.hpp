// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The lengths of law `proxy`, chosen for one size of part and scaled with it.

#include "rt_core/base/scalar.hpp"

namespace haptic {

/// Lengths of the passes; they grow with the part.
struct ProxyScale {
  Real tolerance_m = 0;             ///< depth that counts as free
  Real step_m = 0;                  ///< largest displacement of a pass
  Real turn_rad = 0;                ///< largest turn of a pass
  Real margin_m = 0;                ///< what corrections may add to a displacement
  Real manifold_m = 0;              ///< height within which a face or edge lies in a contact
  Real reach_m = 0;                 ///< pairs farther apart than this cannot meet within a pass
  Real recovery_step_m = 0;         ///< depth taken back in a pass of recovery
  Real still_m = 0, still_rad = 0;  ///< a shorter move ends the tick
};

/// Lengths for a part whose vertices lie within `radius_m` of the grip point, in a scene with
/// coordinates up to `extent_m`; `tolerance_m` replaces the derived one when > 0.
[[nodiscard]] ProxyScale proxy_scale(Real radius_m, Real extent_m, Real tolerance_m) noexcept;

}  // namespace haptic
