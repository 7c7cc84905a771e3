// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Axes of a vendor's library and those of D (x to the operator's right, y away from the operator,
/// z up). Both are right-handed, so a rotation lies between them.

#include "rt_core/base/pose.hpp"
#include "rt_core/exchange/device_exchange.hpp"

namespace haptic::tools {

class VendorAxes {
 public:
  /// `r_dv`: maps vectors of the library's axes to D; each entry 0, 1 or -1.
  explicit VendorAxes(const Mat3& r_dv) : r_dv_(r_dv) {}

  /// Force Dimension: x towards the operator, y to the right, z up.
  [[nodiscard]] static VendorAxes force_dimension() {
    return VendorAxes((Mat3() << 0, 1, 0, -1, 0, 0, 0, 0, 1).finished());
  }
  /// OpenHaptics: x to the right, y up, z towards the operator.
  [[nodiscard]] static VendorAxes open_haptics() {
    return VendorAxes((Mat3() << 1, 0, 0, 0, 0, -1, 0, 1, 0).finished());
  }

  [[nodiscard]] Vec3 to_d(const Vec3& v) const { return r_dv_ * v; }
  [[nodiscard]] Vec3 from_d(const Vec3& v_d) const { return r_dv_.transpose() * v_d; }

  /// Handle point and handle axes in D. The handle's axes are renamed too: where the library says
  /// "not turned", the pose is the identity. False, and `pose_dh` unchanged: not finite, farther
  /// than 2 m from the origin, or no rotation (to 0.01).
  [[nodiscard]] bool pose_to_d(const Vec3& p_m, const Mat3& r, PoseRecord& pose_dh) const;

 private:
  Mat3 r_dv_;
};

}  // namespace haptic::tools
