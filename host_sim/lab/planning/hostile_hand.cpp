// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/planning/hostile_hand.hpp"

#include <algorithm>

#include "host_sim/session/core_session.hpp"
#include "rt_core/base/rotation.hpp"
#include "tools/c_space/pose_text.hpp"
#include "tools/common/error.hpp"
#include "tools/common/split_mix.hpp"

namespace haptic::sim {

Vec3 grip_place(const SceneView& scene, const Pose& pose) {
  const double* const grip_a = scene.bodies()[0].reference_m;
  return pose.p_wa + pose.q_wa * Vec3(static_cast<Real>(grip_a[0]), static_cast<Real>(grip_a[1]),
                                      static_cast<Real>(grip_a[2]));
}

HostileRun run_hostile_hand(std::span<const std::byte> scene, std::uint64_t ticks,
                            std::uint64_t seed) {
  CoreSession session(scene, "guided", GoalContact::kLeftOut);
  const SceneView& view = session.view();
  if (view.guide() == nullptr) throw tools::InputError("the scene has no guide");
  tools::SplitMix64 words(seed);
  const auto centred = [&] { return static_cast<Real>(2 * words.uniform() - 1); };
  const Pose start = tools::pose_from_text(view, "start", "start");
  HostileRun run;
  run.stated_j = view.guide()->energy_j;
  run.ticks = ticks;
  Pose pose = start, before = start;
  Wrench last;
  double sum = 0;
  std::uint64_t mode = 0;
  Vec3 drift = Vec3::Zero();
  for (std::uint64_t k = 0; k < ticks; ++k) {
    if (words.next() % 200 == 0) {
      mode = words.next() % 5;
      drift = 2e-4_r * Vec3(centred(), centred(), centred());
      if (words.next() % 8 == 0) {
        // What the servo tick does about a jump. The account outlives it.
        pose = before = start;
        session.core().reset();
        last = Wrench{};
      }
    }
    const Real sign = mode == 0 ? 1 : mode == 1 ? -1 : 0;
    pose.p_wa += sign * 3e-4_r * last.force_w;  // along the force, or against it
    if (mode == 2) pose.p_wa += (k % 2 == 0 ? 1 : -1) * 1e-3_r * last.force_w;
    if (mode == 3) pose.p_wa += drift;
    if (mode == 4) pose.p_wa += 5e-4_r * Vec3(centred(), centred(), centred());
    pose.q_wa = Quat(Eigen::AngleAxis<Real>(0.02_r * centred(),
                                            Vec3(centred(), centred(), 1.5_r).normalized()) *
                     pose.q_wa)
                    .normalized();
    const Vec3 turn = so3_log(pose.q_wa * before.q_wa.conjugate());
    sum += static_cast<double>(last.force_w.dot(grip_place(view, pose) - grip_place(view, before)) +
                               last.torque_w.dot(turn));
    run.most_j = std::max(run.most_j, sum);
    StepInput input;
    input.pose_wa = pose;
    input.guide_off = words.next() % 1000 == 0;
    const StepResult result = session.core().step(input);
    last = result.guidance.wrench_w;
    run.on += result.guidance.state == GuideState::kOn ? 1u : 0u;
    before = pose;
  }
  return run;
}

}  // namespace haptic::sim
