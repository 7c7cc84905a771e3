// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The law of several bodies over the scenes of its pairs, with the springs of the campaign, and
/// the anchors of loose parts.

#include <cstddef>
#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host_sim/lab/bodies_fuzz/bodies_scene.hpp"
#include "rt_core/bodies/body_law.hpp"
#include "tools/common/scene_bytes.hpp"

namespace haptic::sim {

/// Damage done on purpose, to show that the checks can fail: to the law, or to what is judged.
enum class BodiesFault : std::uint8_t {
  kCertificate,  ///< law: a step is certified that ends twenty tolerances deep
  kSpring,       ///< law: all springs turn a quarter too stiff
  kReaction,     ///< judged: the contact force on one body is a hundredth too large
  kRestless,     ///< judged: in every other tick the first body is 2 um farther from its goal
  kGoal,         ///< judged: bodies are where their goals are
  kBound         ///< judged: the bound of the work of a tick is taken for 0
};
[[nodiscard]] std::optional<BodiesFault> bodies_fault_named(const std::string& name);

[[nodiscard]] GripPose grip_pose_at(const Vector& p, const Rotation& q);
[[nodiscard]] Pose pose_of(const GripPose& pose);

/// The bodies of a scene as they are, or with the springs of the campaign: hands 1000 N/m, drivers
/// as it says, loose parts 100 times a hand's.
[[nodiscard]] std::vector<MovingBody> moving_bodies(const BodiesScene& scene);
/// The lengths of the law for a scene.
[[nodiscard]] ProxyScale bodies_scale(const BodiesScene& scene);

/// Not movable: the law is a view of memory that lies here.
class BodiesSession {
 public:
  /// `compiled` must outlive it; `work_units`: the budget of a tick, 0: none.
  /// @throws tools::InputError when a blob is refused.
  BodiesSession(const CompiledBodies& compiled, std::uint32_t work_units,
                std::optional<BodiesFault> fault);
  BodiesSession(const BodiesSession&) = delete;
  BodiesSession& operator=(const BodiesSession&) = delete;

  /// All bodies are at `poses`, which must be free.
  void begin(std::span<const GripPose> poses);
  /// `goals` of hands and drivers; those of loose parts become their anchors.
  [[nodiscard]] BodiesTick tick(std::span<GripPose> goals);
  /// After a tick: the anchors give way.
  void release_anchors();

  [[nodiscard]] const BodyLaw& law() const { return *law_; }
  /// As they should be, with any fault.
  [[nodiscard]] std::span<const MovingBody> bodies() const { return bodies_; }
  [[nodiscard]] const ProxyScale& scale() const { return scale_; }
  /// Units of work of a tick, at most: its budget, and what it may have begun by then with each
  /// pair, as JointMotion::bounds has it.
  [[nodiscard]] std::uint64_t units_bound() const { return units_bound_; }

 private:
  const BodiesScene& scene_;
  std::vector<MovingBody> bodies_;
  ProxyScale scale_;
  std::deque<tools::SceneBytes> blobs_;
  std::deque<SceneView> views_;
  tools::SceneBytes memory_;
  std::unique_ptr<BodyLaw> law_;
  std::vector<GripPose> anchors_;  ///< by body; of loose parts
  std::uint64_t units_bound_ = 0;
};

}  // namespace haptic::sim
