// SPDX-License-Identifier: Apache-2.0
#include "linker/pose_drive.hpp"

namespace haptic {

RtStatus PoseDrive::open(std::span<const std::byte> blob, std::span<std::byte> state) noexcept {
  ticks_ = 0;
  status_ = SceneView::open(blob, view_);
  if (status_ == RtStatus::kOk) status_ = HapticCore::create(state, view_, core_);
  return status_;
}

StepInput PoseDrive::input_of(const DrivePose& pose) const noexcept {
  StepInput input;
  input.sequence = ticks_;
  input.stamp_ns = pose.stamp_ns;
  for (int axis = 0; axis < 3; ++axis)
    input.pose_wa.p_wa[axis] = static_cast<Real>(pose.p_wa_m[axis]);
  const double* q = pose.q_wa_wxyz;
  input.pose_wa.q_wa = Quat(static_cast<Real>(q[0]), static_cast<Real>(q[1]),
                            static_cast<Real>(q[2]), static_cast<Real>(q[3]));
  return input;
}

DriveTick PoseDrive::tick_of(const StepResult& result) noexcept {
  ++ticks_;
  if (status_ == RtStatus::kOk) status_ = result.status;
  DriveTick tick;
  tick.state_hash = result.state_hash;
  for (int axis = 0; axis < 3; ++axis) {
    tick.force_w_n[axis] = static_cast<double>(result.wrench_w.force_w[axis]);
    tick.torque_w_nm[axis] = static_cast<double>(result.wrench_w.torque_w[axis]);
  }
  tick.flags = result.flags;
  return tick;
}

DriveSummary PoseDrive::summary() const noexcept {
  DriveSummary summary;
  for (std::size_t k = 0; k < sizeof(kDriveMagic); ++k) summary.magic[k] = kDriveMagic[k];
  summary.status = static_cast<std::uint32_t>(status_);
  summary.ticks = ticks_;
  summary.scalar_bytes = sizeof(Real);
  summary.address_bytes = sizeof(void*);
  if (core_ != nullptr) {
    summary.scene_hash = view_.header().content_hash;
    summary.scene_bytes = view_.header().byte_count;
    summary.state_bytes = HapticCore::state_bytes(view_);
  }
  return summary;
}

}  // namespace haptic
