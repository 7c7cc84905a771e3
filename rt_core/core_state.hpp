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
#include "rt_core/contact/contact_region.hpp"
#include "rt_core/contact/near_set.hpp"
#include "rt_core/contact/pair_verdict.hpp"
#include "rt_core/gate_state.hpp"
#include "rt_core/haptic_core.hpp"
#include "rt_core/law/paper_law.hpp"
#include "rt_core/law/proxy_law.hpp"
#include "rt_core/law/weighted_region_law.hpp"
#include "rt_core/output_state.hpp"
#include "rt_core/pair_state.hpp"
#include "rt_core/scene/scene_traits.hpp"

namespace haptic {

/// What an image may do without: patches are merged by the laws but the proxy's, hulls are formed
/// by them and for who asks for the contact's geometry.
inline constexpr bool kMergesPatches = kSceneTraits.paper || kSceneTraits.weighted_region;
inline constexpr bool kFormsHulls = kMergesPatches || kSceneTraits.contact_geometry;

/// Start of the chain of state hashes.
inline constexpr std::uint64_t kHashStart = 0xcbf29ce484222325ull;

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
  BoundedList<Vec3> points, merged_points;  ///< paper's law: of all patches; of those in one plane
  BoundedList<WeightedContact> contacts;
  SceneFlag<&SceneTraits::hidden_nodes> has_seams;  ///< some pair has nodes that only separate
  std::span<bool> joined;                           ///< per patch: a contact has it
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
  std::uint64_t tick = 0, hash = kHashStart;
  std::uint64_t searched_at = 0;  ///< tick in which the goal pose was searched last
  StepPeaks peaks;

  /// Places everything in `arena`; with a counting arena only the size is computed.
  void place(Arena& arena, const SceneView& view) noexcept;
  void read_scene(const SceneView& view) noexcept;
  void forget() noexcept;
  [[nodiscard]] bool has_law(LawId id) const noexcept { return kSceneTraits.is_law(law, id); }

  /// The part has one orientation: the device's is not looked at.
  [[nodiscard]] bool is_fixed() const noexcept { return kSceneTraits.is_fixed(never_turns); }

  /// The device is taken for one of three degrees of freedom: a part that never turns has no torque
  /// under law proxy; the others tell it.
  [[nodiscard]] bool device_translates() const noexcept {
    return !kSceneTraits.device_turns || (never_turns && has_law(LawId::kProxy));
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
  void search_goal(const GripPose& grip, StepResult& result) noexcept;
  void report_contact(StepResult& result) const noexcept;
  void felt_geometry(std::uint32_t index, ContactGeometry& out) noexcept;
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
  [[nodiscard]] bool joins(const ContactPatch& patch, const ContactPatch& leader) const noexcept;
  [[nodiscard]] Real weight_of(const NearNode& node, Real d_near_m) const noexcept;
  void add_to_contact(const ContactPatch& patch, const ContactPatch& contact) noexcept;
  void add_points(const ContactPatch& patch) noexcept;
  [[nodiscard]] Wrench contact_wrench(std::uint32_t first, StepResult& result) noexcept;
  void chain_hash(const StepResult& result) noexcept;
};

}  // namespace haptic
