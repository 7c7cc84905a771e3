// SPDX-License-Identifier: Apache-2.0
#include "tools/bridges/vendor/vendor_axes.hpp"

namespace haptic::tools {
namespace {

// No desk device reaches so far; what says so is no position in metres.
constexpr Real kFarthest_m = 2.0_r;
// Libraries round, and OpenHaptics' matrices are known to be off by some 1e-3 (CHAI3D corrects
// them for that reason).
constexpr Real kFarthestFromRotation = 0.01_r;

}  // namespace

bool VendorAxes::pose_to_d(const Vec3& p_m, const Mat3& r, PoseRecord& pose_dh) const {
  if (!is_finite(p_m) || !r.allFinite()) return false;
  if (robust_length(p_m) > kFarthest_m) return false;
  const Mat3 residual = r.transpose() * r - Mat3::Identity();
  if (!(residual.cwiseAbs().maxCoeff() <= kFarthestFromRotation) || r.determinant() <= 0)
    return false;
  Quat q(Mat3(r_dv_ * r * r_dv_.transpose()));
  q.normalize();
  pose_dh = record_of(Pose{to_d(p_m), q});
  return true;
}

}  // namespace haptic::tools
