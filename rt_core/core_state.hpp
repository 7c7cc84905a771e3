// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Inside of HapticCore: all of its mutable state, placed by the caller, and the stages of one
/// tick. Not for inclusion outside rt_core.

#include <cstddef>
#include <cstdint>
#include <span>

#include "rt_core/base/arena.hpp"
#include "rt_core/base/bounded_list.hpp"
#include "rt_core/base/twist_estimator.hpp"
#include "rt_core/contact/contact_region.hpp"
#include "rt_core/contact/near_set.hpp"
#include "rt_core/contact/pair_gate.hpp"
#include "rt_core/contact/pair_verdict.hpp"
#include "rt_core/haptic_core.hpp"
#include "rt_core/law/paper_law.hpp"
#include "rt_core/law/proxy_law.hpp"
#include "rt_core/law/weighted_region_law.hpp"
#include "rt_core/safety/passivity.hpp"
#include "rt_core/safety/wrench_ramp.hpp"

namespace haptic {

/// Start of the chain of state hashes.
inline constexpr std::uint64_t kHashStart = 0xcbf29ce484222325ull;

/// What the core keeps of each pair, besides its gate.
struct PairState {
  PairView view;
  FeatureBounds bounds;
  VerdictMemory verdict_memory;
  VerdictResult verdict;
  NearNode best;  ///< node of D_near at the last visit
  Real d_near_m = 0;
  std::uint64_t visited_at = 0;  ///< number of the tick; 0: never
  bool exact = false;
  std::uint32_t near_begin = 0, near_count = 0;  ///< of this tick's visit
  std::uint32_t contact_begin = 0, contact_count = 0;
  ContactSituation situation = ContactSituation::kNone;
};

/// What the gate reads of each pair in every tick: kept apart, so that far pairs cost little.
struct PairGateState {
  GatePlane plane;
  double reach_a_m = 0, reach_b_m = 0;  ///< levers of the odometers
  std::uint32_t body_b = 0;
};

/// A static body's share of the odometers.
struct BodyMotion {
  Vec3 reference_w = Vec3::Zero();
  double swept_m = 0;  ///< sum of the turn times the distance of the grip point from the reference
};

/// A pair that must be looked at, and how near it may be.
struct Candidate {
  double gap_m = 0;
  std::uint32_t pair = 0;
};

/// Where the goal lies off the device: what the clutch and the anchor have added.
struct GoalOffset {
  Vec3 translation_m = Vec3::Zero();
  Quat rotation = Quat::Identity();
  bool is_zero = true;  ///< then the goal is the device's pose, bit by bit
  bool clutched = false;
};

/// What stands between the law and the device.
struct OutputState {
  std::int64_t period_ns = 0;
  std::int64_t stamp_ns = 0;  ///< of the last report
  bool has_stamp = false;
  Real damping_ns_per_m = 0, damping_share = 0;  ///< of the coupling
  PoseError error, rate;                         ///< of the coupling: last, and filtered rate
  bool has_error = false;
  bool observes = false;  ///< the passivity layer acts
  Passivity passivity;
  WrenchRamp ramp;
  std::span<TwistEstimator> twist;  ///< one where the scene names a device, else none
};

struct HapticCore::State {
  SceneView scene;
  Vec3 grip_a = Vec3::Zero();  ///< grip point in A's mesh frame
  LawId law = LawId::kWeightedRegion;
  Real k_f_n_per_m = 0;
  Real epsilon_m = 0, epsilon_o_m = 0;
  double exact_band_m = 0;
  Real max_step_m = 0, max_turn_rad = 0;  ///< motion per tick of the speed certificate; 0: none
  std::uint32_t max_visits = 0;

  std::span<PairState> pairs;
  std::span<PairGateState> gates;  ///< by pair
  std::span<BodyMotion> bodies;
  std::span<Real> moving_lanes;              ///< turned vertices, by moving piece
  std::span<std::size_t> lanes_begin;        ///< of each moving piece
  std::span<std::uint64_t> lanes_turned_at;  ///< tick in which each piece was turned
  NearScratch scratch;
  BoundedList<NearNode> near;  ///< near sets of the pairs visited in this tick
  BoundedList<std::uint32_t> contact_nodes;
  BoundedList<Candidate> candidates;
  BoundedList<ContactPatch> patches;
  BoundedList<Vec3> points;         ///< paper's law: of all patches
  BoundedList<Vec3> merged_points;  ///< of the patches that share a plane
  BoundedList<WeightedContact> contacts;
  std::span<std::uint8_t> merged;  ///< per patch: already part of an earlier one
  HullScratch hull;

  Proxy proxy;  ///< law kProxy only
  Spring spring;
  Real proxy_radius_m = 0;  ///< of A about the grip point
  AnchorLimits anchor;
  GoalOffset offset;
  GripPose frozen_goal;  ///< while clutched
  OutputState output;

  MotionSum motion;
  GripPose last;
  bool has_last = false;
  std::uint64_t tick = 0;
  std::uint64_t hash = kHashStart;
  StepPeaks peaks;

  /// Places everything in `arena`; with a counting arena only the size is computed.
  void place(Arena& arena, const SceneView& view) noexcept;
  void read_scene(const SceneView& view) noexcept;
  void forget() noexcept;

  [[nodiscard]] GripPose goal_of(const GripPose& device, bool clutched,
                                 StepResult& result) noexcept;
  void set_offset(const GripPose& device, const GripPose& goal) noexcept;
  void place_proxy(Arena& arena, const SceneView& view) noexcept;
  void configure_proxy() noexcept;
  [[nodiscard]] Wrench proxy_wrench(const GripPose& goal, std::int64_t stamp_ns,
                                    StepResult& result) noexcept;
  void configure_output() noexcept;
  void forget_output() noexcept;
  [[nodiscard]] std::int64_t stamp_of(const StepInput& input) noexcept;
  void damp(const PoseError& error, std::int64_t stamp_ns, Wrench& wrench) noexcept;
  [[nodiscard]] Wrench finish(const Wrench& law_wrench, const GripPose& device,
                              const StepInput& input, StepResult& result) noexcept;
  [[nodiscard]] Pose mesh_pose(const GripPose& grip) const noexcept;
  void advance(const GripPose& grip, StepResult& result) noexcept;
  [[nodiscard]] Odometer odometer(const PairGateState& gate) const noexcept;
  void pass_gate(const GripPose& grip, StepResult& result) noexcept;
  void spend_budget(const GripPose& grip, StepResult& result) noexcept;
  [[nodiscard]] PairPose pose_of(std::uint32_t pair, const GripPose& grip) noexcept;
  void visit(std::uint32_t pair, const GripPose& grip, StepResult& result) noexcept;
  void hold(const Candidate& candidate, const GripPose& grip, StepResult& result) noexcept;
  void touch(PairState& pair, const PairPose& pose, StepResult& result) noexcept;
  void report_nearest(std::uint32_t pair, Real d_near_m, StepResult& result) const noexcept;
  [[nodiscard]] Wrench total_wrench(StepResult& result) noexcept;
  void add_to_group(const ContactPatch& patch, ContactPatch& group) noexcept;
  void chain_hash(const StepResult& result) noexcept;
};

}  // namespace haptic
