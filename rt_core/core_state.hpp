// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Inside of HapticCore: all of its mutable state, placed by the caller, and the stages of one
/// tick. Not for inclusion outside rt_core.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "rt_core/base/arena.hpp"
#include "rt_core/base/bounded_list.hpp"
#include "rt_core/base/twist_estimator.hpp"
#include "rt_core/contact/contact_identity.hpp"
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
#include "rt_core/scene/scene_traits.hpp"

namespace haptic {

/// What an image may do without: patches are merged by the laws but the proxy's, hulls are formed
/// by them and for who asks for the contact's geometry.
inline constexpr bool kMergesPatches = kSceneTraits.paper || kSceneTraits.weighted_region;
inline constexpr bool kFormsHulls = kMergesPatches || kSceneTraits.contact_geometry;

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
  Real full_m = 0;               ///< D_near over all nodes, those that only separate too
  std::uint64_t visited_at = 0;  ///< number of the tick; 0: never
  bool exact = false;
  SceneFlag<&SceneTraits::hidden_nodes> has_hidden;  ///< some of its nodes only separate
  bool bears = true;                                 ///< `best` can carry a force
  std::array<FacePlane, 2> of_neighbour{};           ///< as in ContactPatch
  std::uint32_t passed_node = 0;
  Real lent_m = 0;                               ///< apart, but this deep by its live nodes; 0: not
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

/// How much of a near node no group has yet, and how much is in the group that is being formed.
struct NodeShare {
  Real left = 1, joining = 0;
};

/// The same of a patch.
struct PatchShare {
  Real left = 1, joining = 0;
  Real past_ends = 0;  ///< how much of what it is nearest to it does not hold
  bool led = false;    ///< a group of its own has been formed
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
  /// Where it lies in the caller's memory: behind the core, which is one address. The alignment is
  /// that of the 64-bit members, which 32-bit machines have too.
  static constexpr std::size_t kOffset = alignof(std::uint64_t);
  static_assert(sizeof(HapticCore) <= kOffset);

  SceneView scene;
  Vec3 grip_a = Vec3::Zero();  ///< grip point in A's mesh frame
  LawId law = LawId::kWeightedRegion;
  Real k_f_n_per_m = 0;
  Real epsilon_m = 0, epsilon_o_m = 0;
  double exact_band_m = 0;
  /// Pairs that are farther apart lend no nodes to a contact of the piece beside.
  Real lending_m = 0;
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
  BoundedList<ContactIdentity> identities;          ///< of the contacts, where bodies have seams
  SceneFlag<&SceneTraits::hidden_nodes> has_seams;  ///< some pair has nodes that only separate
  std::span<PatchShare> shares;                     ///< per patch
  std::span<NodeShare> node_shares;                 ///< per near node, where bodies have seams
  HullScratch hull;

  Proxy proxy;  ///< law kProxy only
  Spring spring;
  Real proxy_radius_m = 0;  ///< of A about the grip point
  AnchorLimits anchor;
  GoalOffset offset;
  GripPose frozen_goal;  ///< while clutched
  OutputState output;

  MotionEnvelope envelope;   ///< the scene's
  bool never_turns = false;  ///< the envelope is one orientation, whatever the device's is
  Mat3 fixed_r_wa = Mat3::Identity();  ///< that orientation
  EnvelopeWatch watch;                 ///< over the goal
  bool left = false;                   ///< the envelope, since the last reset

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
  [[nodiscard]] bool has_law(LawId id) const noexcept { return kSceneTraits.is_law(law, id); }

  /// The part has one orientation: the device's is not looked at.
  [[nodiscard]] bool is_fixed() const noexcept { return kSceneTraits.is_fixed(never_turns); }

  /// The device is taken for one of three degrees of freedom.
  [[nodiscard]] bool device_translates() const noexcept {
    return !kSceneTraits.device_turns || never_turns;
  }

  [[nodiscard]] GripPose device_grip(const Pose& pose_wa) const noexcept;
  [[nodiscard]] GripPose goal_of(const GripPose& device, bool clutched,
                                 StepResult& result) noexcept;
  void set_offset(const GripPose& device, const GripPose& goal) noexcept;
  [[nodiscard]] bool keep_inside(GripPose& goal, StepResult& result) noexcept;
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
  void remember(const GripPose& grip) noexcept;
  [[nodiscard]] Odometer odometer(const PairGateState& gate) const noexcept;
  void pass_gate(const GripPose& grip, StepResult& result) noexcept;
  void spend_budget(const GripPose& grip, StepResult& result) noexcept;
  [[nodiscard]] PairPose pose_of(std::uint32_t pair, const GripPose& grip) noexcept;
  void visit(std::uint32_t pair, const GripPose& grip, StepResult& result) noexcept;
  void measure_live(PairState& pair, const PairPose& pose, const NearResult& found,
                    StepResult& result) noexcept;
  void hold(const Candidate& candidate, const GripPose& grip, StepResult& result) noexcept;
  void touch(PairState& pair, const PairPose& pose, StepResult& result) noexcept;
  void report_nearest(std::uint32_t pair, Real d_near_m, StepResult& result) const noexcept;
  [[nodiscard]] Wrench total_wrench(StepResult& result) noexcept;
  /// Groups of patches share nodes, not patches.
  [[nodiscard]] bool shares_nodes() const noexcept { return has_seams && !has_law(LawId::kPaper); }
  [[nodiscard]] bool joins(const ContactPatch& patch, const ContactPatch& group) const noexcept;
  [[nodiscard]] Real share_in(const ContactPatch& patch, const ContactPatch& leader) const noexcept;
  [[nodiscard]] Real held_by(const ContactPatch& holder, const ContactPatch& patch) const noexcept;
  [[nodiscard]] Real past_ends(const ContactPatch& patch) const noexcept;
  [[nodiscard]] std::uint32_t next_leader() const noexcept;
  [[nodiscard]] Real coplanar_in(const ContactPatch& patch, const Vec3& n) const noexcept;
  void share_nodes(const ContactPatch& patch, const ContactPatch& leader, Real share) noexcept;
  [[nodiscard]] Real weight_of(const NearNode& node, Real d_near_m, Real outside_m) const noexcept;
  void add_to_group(const ContactPatch& patch, const ContactPatch& group) noexcept;
  void add_points(const ContactPatch& patch) noexcept;
  void add_past_ends(const ContactPatch& patch, const ContactPatch& group) noexcept;
  void add_contact(const NearNode& node, const PairView& pair, Real weight) noexcept;
  [[nodiscard]] ContactPatch form_group(std::uint32_t first, const ContactPatch& leader) noexcept;
  [[nodiscard]] Wrench group_wrench(std::uint32_t first, StepResult& result) noexcept;
  void hold_on(const ContactPatch& leader, const ContactPatch& group, Real share,
               Wrench& wrench) noexcept;
  void lead_with_passed(ContactPatch& group) noexcept;
  void chain_hash(const StepResult& result) noexcept;
};

}  // namespace haptic
