// SPDX-License-Identifier: Apache-2.0
#include "linker/image_run.hpp"

#include "rt_core/base/rotation.hpp"
#include "rt_core/haptic_core.hpp"

namespace haptic {
namespace {

constexpr std::uint32_t kTicksDown = 500;
constexpr std::uint32_t kTicks = 2 * kTicksDown;
constexpr Real kTravel_m = 0.02_r;
constexpr Real kTurn_rad = 0.3_r;

bool rotation_holds() noexcept {
  const Vec3 rotation_rad(0.4_r, -0.7_r, 0.2_r);
  const Vec3 back_rad = so3_log(so3_exp(rotation_rad));
  return (back_rad - rotation_rad).squaredNorm() <
         1.0e-10_r;  // far above float's rounding, far below a wrong branch
}

/// Pose of tick `tick`: down for the first half, back for the second.
Pose drive_pose(const SceneParameters& scene, std::uint32_t tick) noexcept {
  const std::uint32_t way = tick < kTicksDown ? tick : kTicks - tick;
  const Real part = static_cast<Real>(way) / static_cast<Real>(kTicksDown);
  Pose pose;
  for (int axis = 0; axis < 3; ++axis)
    pose.p_wa[axis] = static_cast<Real>(scene.start_p_wa_m[axis]);
  pose.p_wa[2] -= kTravel_m * part;
  const double* q = scene.start_q_wa_xyzw;
  const Quat start(static_cast<Real>(q[3]), static_cast<Real>(q[0]), static_cast<Real>(q[1]),
                   static_cast<Real>(q[2]));
  const Vec3 axis(0.6_r, 0.0_r, 0.8_r);
  pose.q_wa = start * so3_exp(kTurn_rad * part * axis);
  pose.q_wa.normalize();
  return pose;
}

constexpr std::size_t kPoseReals = 7;

Pose motion_pose(std::span<const Real> motion, std::uint32_t tick) noexcept {
  const Real* const r = motion.data() + kPoseReals * tick;
  Pose pose;
  pose.p_wa = Vec3(r[0], r[1], r[2]);
  pose.q_wa = Quat(r[6], r[3], r[4], r[5]);
  return pose;
}

/// Law proxy pulls at a part that was left behind a wall although the device is free, so that
/// along a motion force is not judged by the device's pose.
ImageReport drive(HapticCore& core, const SceneParameters& scene,
                  std::span<const Real> motion) noexcept {
  const auto ticks =
      motion.empty() ? kTicks : static_cast<std::uint32_t>(motion.size() / kPoseReals);
  ImageReport report;
  std::uint32_t pushed_ticks = 0;
  StepInput input;
  for (std::uint32_t tick = 0; tick < ticks; ++tick) {
    input.sequence = tick;
    input.stamp_ns = std::int64_t{tick} * 1'000'000;
    input.pose_wa = motion.empty() ? drive_pose(scene, tick) : motion_pose(motion, tick);
    const StepResult result = core.step(input);
    if (result.status != RtStatus::kOk) {
      report.verdict = ImageVerdict::kTickFailed;
      return report;
    }
    const bool in_contact = result.d_near_m <= 0;
    const bool pushed = result.wrench_w.force_w.squaredNorm() > 0;
    if (motion.empty() && pushed && !in_contact) report.verdict = ImageVerdict::kForceWhenFree;
    pushed_ticks += pushed ? 1u : 0u;
    report.contact_ticks += in_contact ? 1u : 0u;
    report.hash = (report.hash ^ result.state_hash) * 0x100000001b3u;  // FNV-1a's prime
    ++report.ticks;
  }
  if (report.verdict == ImageVerdict::kDone && pushed_ticks == 0) {
    report.verdict = ImageVerdict::kNoContact;
  }
  return report;
}

}  // namespace

ImageReport run_image(std::span<const std::byte> blob, std::span<std::byte> state,
                      std::span<const Real> motion) noexcept {
  const auto refused = [](ImageVerdict verdict) noexcept {
    ImageReport report;
    report.verdict = verdict;
    return report;
  };
  if (!rotation_holds()) return refused(ImageVerdict::kRotationWrong);
  SceneView view;
  if (SceneView::open(blob.first(blob.size() / 2), view) == RtStatus::kOk) {
    return refused(ImageVerdict::kBadBlobTaken);
  }
  if (SceneView::open(blob, view) != RtStatus::kOk) return refused(ImageVerdict::kSceneRefused);
  HapticCore* core = nullptr;
  if (HapticCore::create(state, view, core) != RtStatus::kOk)
    return refused(ImageVerdict::kMemoryRefused);

  ImageReport first = drive(*core, view.parameters(), motion);
  if (first.verdict != ImageVerdict::kDone) return first;
  core->reset();
  const ImageReport second = drive(*core, view.parameters(), motion);
  if (second.hash != first.hash) first.verdict = ImageVerdict::kNotRepeatable;
  return first;
}

}  // namespace haptic
