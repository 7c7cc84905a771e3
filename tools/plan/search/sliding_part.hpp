// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The felt part as a motion engine: pushed towards a pose, it slides along what is in the way, and
/// each of its micro-steps is certified by the core. No friction, no damping, one pass a tick.

#include <cstdint>
#include <memory>
#include <vector>

#include "rt_core/haptic_core.hpp"
#include "tools/plan/search/pose_algebra.hpp"

namespace haptic::tools {

/// How far a push goes, and when it ends.
struct PushLimits {
  std::uint32_t most_ticks = 400;
  double still = 1.0e-6;  ///< a tick that moves less is still, in radii of the part
  std::uint32_t still_ticks = 4;
};

struct PushResult {
  bool arrived = false;  ///< at the target, within rounding
  std::uint32_t ticks = 0;
};

/// A plane that holds the part, as a push ends.
struct HoldingPlane {
  PairIndex pair = 0;
  ContactType type = ContactType::kA;
  Vec3d normal_w = Vec3d::Zero();  ///< from B to A
};

class SlidingPart {
 public:
  /// Makes a scene of its own from `scene`: of law proxy, without friction. @throws InputError when
  /// that is refused.
  explicit SlidingPart(const SceneView& scene);
  SlidingPart(SlidingPart&&) noexcept;
  SlidingPart& operator=(SlidingPart&&) noexcept;
  ~SlidingPart();

  /// The next push begins here; the pose must be free.
  void place(const PlanPose& pose);
  /// Pushes from where the part is towards `target`; appends the end of every step to `path`.
  PushResult push(const PlanPose& target, const PushLimits& limits, std::vector<PlanPose>& path);

  [[nodiscard]] const PlanPose& at() const { return at_; }
  /// Planes that held it in the last tick.
  [[nodiscard]] std::vector<HoldingPlane> holding() const;
  /// A number of the contact state: of the planes' pairs and kinds, in no order.
  [[nodiscard]] std::uint64_t contact_state() const;
  [[nodiscard]] std::uint64_t ticks() const { return tick_; }
  [[nodiscard]] double radius_m() const { return radius_m_; }

  /// Between poses of the mesh frame and of the grip point.
  [[nodiscard]] PlanPose grip_pose(const Pose& mesh) const;
  [[nodiscard]] Pose mesh_pose(const PlanPose& pose) const;

 private:
  struct Engine;  // a scene and the core over it
  std::unique_ptr<Engine> engine_;
  Vec3d grip_a_ = Vec3d::Zero();
  double radius_m_ = 0;
  PlanPose at_;
  std::uint64_t tick_ = 0;
};

}  // namespace haptic::tools
