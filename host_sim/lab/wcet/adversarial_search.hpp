// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Looks for the worst that a scene can do in one tick: seeded hill climbing, one climb per kind of
/// worst, over short motions. A measurement over given motions never meets these.

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "host_sim/session/core_session.hpp"
#include "host_sim/shapes/shapes.hpp"

namespace haptic::sim {

// Short motions that a search can change bit by bit: a start pose and the velocities after it,
// never faster than a hand.

inline constexpr std::size_t kMotionSegments = 4, kSegmentTicks = 8;
inline constexpr double kAdversarialSpeed_m_per_s = 1.0, kAdversarialTurn_rad_per_s = 10.0;

/// Velocities of one segment, W axes, turning about A's reference point.
struct SegmentVelocity {
  Vector v_m_per_s = Vector::Zero(), w_rad_per_s = Vector::Zero();
};

struct AdversarialMotion {
  Vector p_wr = Vector::Zero();  ///< A's reference point in W at the start [m]
  Rotation q_wa = Rotation::Identity();
  std::array<SegmentVelocity, kMotionSegments> segments;
};

/// Where such motions lie: about the static bodies, and about the poses of a motion of the scene.
class AdversarialSpace {
 public:
  /// `known` must outlive this; not empty.
  AdversarialSpace(const SceneView& view, std::span<const MotionSample> known);

  /// Two of three start within a hundredth of A's radius of a known pose, the third anywhere about
  /// the static bodies and any way up.
  [[nodiscard]] AdversarialMotion drawn(Seeded& random) const;

  /// Like `motion`, with its start shifted or turned, or a segment's velocity changed or drawn
  /// again; by how much is drawn over six powers of ten.
  [[nodiscard]] AdversarialMotion changed(const AdversarialMotion& motion, Seeded& random) const;

  /// Samples at the scene's rate, exactly as a motion file has them: what read_motion_csv gives of
  /// them is what as_read gives.
  [[nodiscard]] std::vector<MotionSample> samples(const AdversarialMotion& motion) const;

 private:
  [[nodiscard]] SegmentVelocity drawn_velocity(Seeded& random) const;

  std::span<const MotionSample> known_;
  Vector reference_m_;  ///< of A, in its frame
  Vector low_m_, high_m_;
  double radius_m_, period_s_;
};

/// The sample as read_motion_csv gives it back: quaternion normalised.
[[nodiscard]] MotionSample as_read(const MotionSample& sample);

enum class AdversarialGoal : std::uint8_t {
  kWork,              ///< units of work of one tick (work_units)
  kTime,              ///< wall time of one tick [ns], least of the repeats
  kForceStep,         ///< change of force from one tick to the next [N]
  kTorqueStep,        ///< change of torque from one tick to the next [N m]
  kSituationChanges,  ///< changes of the contact situation within the motion
  kProxyWork          ///< units of work of the proxy in one tick (proxy_units); law kProxy alone
};
inline constexpr AdversarialGoal kAdversarialGoals[] = {AdversarialGoal::kWork,
                                                        AdversarialGoal::kTime,
                                                        AdversarialGoal::kForceStep,
                                                        AdversarialGoal::kTorqueStep,
                                                        AdversarialGoal::kSituationChanges,
                                                        AdversarialGoal::kProxyWork};
/// E.g. "force_step"; `unit_of` e.g. "N".
[[nodiscard]] const char* to_text(AdversarialGoal goal);
[[nodiscard]] const char* unit_of(AdversarialGoal goal);

/// How far a search is.
struct AdversarialProgress {
  AdversarialGoal goal = AdversarialGoal::kWork;
  double best = 0;                ///< of this climb so far
  std::uint64_t evaluations = 0;  ///< of this climb so far
  double elapsed_s = 0;           ///< of all climbs
};

struct AdversarialLimits {
  double seconds = 10;            ///< of all climbs together, when evaluations is 0
  std::uint64_t evaluations = 0;  ///< of each climb; 0: as many as the time allows
  std::uint64_t seed = 1;
  /// Called about once a second; what it takes is part of the search's time.
  std::function<void(const AdversarialProgress&)> progress = {};
};

/// What came together in the tick of a step of force or torque.
struct StepCause {
  double spring = 0;   ///< change of the spring's part, in the goal's unit
  double damping = 0;  ///< change of the rest: coupling damping and passivity control
  double goal_m = 0;   ///< how far the goal moved since the tick before, grip point
  double proxy_m = 0;  ///< how far the proxy moved; other laws: the goal
  double goal_rad = 0, proxy_rad = 0;
  std::uint32_t flags = 0;  ///< StepFlag of the tick
};

/// What one climb found.
struct AdversarialFinding {
  AdversarialGoal goal = AdversarialGoal::kWork;
  double value = 0;
  std::size_t tick = 0;              ///< of the motion; 0 for kSituationChanges
  std::vector<MotionSample> motion;  ///< as a motion file has it; replay starts from reset
  std::uint64_t evaluations = 0, restarts = 0;
  StepCounters peaks;            ///< of every motion that the climb tried
  std::uint64_t not_finite = 0;  ///< ticks whose wrench was not finite
  std::uint64_t state_hash = 0;  ///< after the motion found
  StepCause cause;               ///< of kForceStep and kTorqueStep
};

/// The goals that the law of a scene has.
[[nodiscard]] std::vector<AdversarialGoal> goals_of(const SceneView& view);

/// One climb per goal of the scene, each with a seed of its own from `limits.seed`. With
/// `evaluations` given, all but kTime are the same numbers in every run. Leaves the core reset.
/// @throws tools::InputError: `known` is empty.
[[nodiscard]] std::vector<AdversarialFinding> adversarial_search(
    CoreSession& session, std::span<const MotionSample> known, const AdversarialLimits& limits);

/// The value of a goal for a motion as a file has it, with its tick; raises `finding.peaks`.
void evaluate(CoreSession& session, std::span<const MotionSample> motion,
              AdversarialFinding& finding);

}  // namespace haptic::sim
