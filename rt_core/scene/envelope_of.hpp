// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Numbers of a scene as the core takes them.

#include "rt_core/base/motion_envelope.hpp"
#include "rt_core/base/scalar.hpp"
#include "rt_core/scene/scene_format.hpp"

namespace haptic {

[[nodiscard]] inline Vec3 point_of(const double (&v)[3]) noexcept {
  return {static_cast<Real>(v[0]), static_cast<Real>(v[1]), static_cast<Real>(v[2])};
}

/// Where the part may go.
[[nodiscard]] inline MotionEnvelope envelope_of(const SceneParameters& p) noexcept {
  MotionEnvelope envelope;
  const EnvelopeParameters& e = p.envelope;
  if ((e.given & kOrientationGiven) != 0) {
    const double* q = e.q_wa_xyzw;
    envelope.q_wa = Quat(static_cast<Real>(q[3]), static_cast<Real>(q[0]), static_cast<Real>(q[1]),
                         static_cast<Real>(q[2]))
                        .normalized();
    envelope.max_angle_rad = static_cast<Real>(e.max_angle_rad);
  }
  if ((e.given & kWorkspaceGiven) != 0) {
    envelope.centre_w = (point_of(e.min_m) + point_of(e.max_m)) / 2;
    envelope.half_extent_m = (point_of(e.max_m) - point_of(e.min_m)) / 2;
  }
  return envelope;
}

}  // namespace haptic
