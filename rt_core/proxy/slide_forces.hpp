// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The balance of the forces on a part that slides: of as many unknowns as there are forces.

#include <array>
#include <cstdint>
#include <span>

#include "rt_core/proxy/proxy_qp.hpp"
#include "rt_core/scene/proxy_limits.hpp"

namespace haptic {

/// A force that holds the part, in the coordinates of the program: of a point that slides, the edge
/// of its cone against the slip, for its plane; else that of one row, for that.
struct SlideForce {
  QpVector along = QpVector::Zero(), plane = QpVector::Zero();
  Real h = 0;     ///< what plane.z is to be
  Real size = 0;  ///< along `along`, > 0
  /// Of a point that slides: the direction across its slip, by what a motion along that turns the
  /// friction, over the motion, and the length of the slip.
  QpVector across = QpVector::Zero();
  Real turns = 0, slip_m = 0;
  std::uint32_t cone = kMaxFrictionCones;
};

/// The forces of one program.
struct SlideForces {
  std::array<SlideForce, kQpSize> forces;
  std::array<std::uint32_t, kQpSize> stuck{};  ///< cones of those that stick
  std::uint32_t count = 0, stuck_count = 0;
  bool slides = false;  ///< one of them does
};

/// Changes the forces by as little as may be, so that plane_i.z = h_i of what they make of z, which
/// is returned: as many equations as forces, of which some may depend on others, as those of four
/// corners on a face do. `error`: what the motion is more than z. One step of Newton's method:
/// exact where no slip changes its direction. At most kQpSize forces; finite for finite ones. Cost:
/// two factorisations of 6 x 6 and eight solutions, some 1.5 us at the most.
[[nodiscard]] QpVector balance(std::span<SlideForce> forces, const QpVector& error) noexcept;

}  // namespace haptic
