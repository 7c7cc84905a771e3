// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The contact at the goal pose: which pairs can matter, their verdicts, near sets and contact
/// patches (paper Sec. III and IV). Law paper needs it in every tick, law proxy
/// when the caller asks.

#include <cstdint>
#include <limits>
#include <span>

#include "rt_core/base/bounded_list.hpp"
#include "rt_core/base/pose.hpp"
#include "rt_core/base/step_flags.hpp"
#include "rt_core/scene/scene_traits.hpp"
#include "rt_core/tracking/contact_polygon.hpp"
#include "rt_core/tracking/contact_region.hpp"
#include "rt_core/tracking/pair_gate.hpp"
#include "rt_core/tracking/pair_report.hpp"
#include "rt_core/tracking/search_room.hpp"

namespace haptic {

/// What an image may do without: patches are merged by the laws but the proxy's, hulls are formed
/// by them and for who asks for the contact's geometry.
inline constexpr bool kMergesPatches = kSceneTraits.has_laws_at_goal();
inline constexpr bool kFormsHulls = kMergesPatches || kSceneTraits.contact_geometry;

/// Work of a search, and the flags that it sets.
struct SearchWork {
  std::uint32_t pair_visits = 0, support_pairs = 0, feature_evaluations = 0, edge_pairs = 0;
  std::uint32_t near_nodes = 0, stale_pairs = 0;
  std::uint32_t flags = 0;  ///< of kGoalContactFlags

  void add(const SearchWork& other) noexcept;
};

/// What one search returns. Spans hold until the next tick.
struct ContactSet {
  bool searched = false;
  Real d_near_m = kNotSearched;                          ///< smallest over all pairs
  std::uint32_t nearest_pair = 0;                        ///< the pair it belongs to
  ContactSituation situation = ContactSituation::kNone;  ///< of the pair that is felt
  std::uint32_t near_count = 0;                          ///< of the pair that is felt
  std::span<const NearNode> near;                        ///< of all pairs
  std::span<const ContactPatch> patches;  ///< of the colliding pairs, but of law kProxy
  std::span<const Vec3> points;           ///< application points of all patches
  SearchWork work;
};

/// Room for near nodes: of one pair, or of all that are searched and of those that are held for
/// want of budget, with the one node that each keeps.
[[nodiscard]] constexpr std::size_t near_room(const SceneCapacity& c, bool searches) noexcept {
  return searches ? std::size_t{c.max_near_nodes} + c.pair_count : std::size_t{c.largest_near};
}

/// Keeps what a search needs of the one before: bounds, gates, certificates.
class GoalContactStage {
 public:
  /// `searches`: the scene has what search() needs; else there is room for one pair's near set.
  void place(Arena& arena, const SceneView& scene, bool searches) noexcept;
  /// `pairs`: of the scene, one each, or none where nothing is searched; they outlive it.
  void read_scene(const SceneView& scene, std::span<const PairView> pairs) noexcept;
  void reset() noexcept;

  /// Begins a tick: forgets the near sets of the last one and sums the motion up, searched or not.
  /// @return kFlagMotionExceeded where there was more of it than the scene states.
  [[nodiscard]] std::uint32_t advance(const GripPose& goal) noexcept;
  [[nodiscard]] ContactSet search(const GripPose& goal) noexcept;

  /// Memory of the search; free between searches.
  [[nodiscard]] SearchRoom& room() noexcept { return room_; }
  /// Some pair has basic contacts that only separate.
  [[nodiscard]] bool has_seams() const noexcept { return has_seams_; }
  /// What the last tick found out about a pair.
  [[nodiscard]] PairReport report(std::uint32_t pair) const noexcept;
  /// Contact of a pair in the last search, into the emptied `out`.
  void describe(std::uint32_t pair, const HullScratch& hull, ContactGeometry& out) const noexcept;

 private:
  /// What is kept of each pair, besides its gate.
  struct PairState {
    FeatureBounds bounds;
    VerdictMemory verdict_memory;
    VerdictResult verdict;
    NearNode best;  ///< node of D_near at the last visit
    Real d_near_m = 0;
    std::uint64_t visited_at = 0;  ///< number of the tick; 0: never
    bool exact = false;
    bool has_hidden = false;                       ///< some of its nodes only separate
    bool bears = true;                             ///< some node that can carry a force is left
    std::uint32_t near_begin = 0, near_count = 0;  ///< of this tick's visit
    std::uint32_t contact_begin = 0, contact_count = 0;
    ContactSituation situation = ContactSituation::kNone;
  };
  /// What the gate reads of each pair in every search: kept apart, so that far pairs cost little.
  struct PairGate {
    GatePlane plane;
    double reach_a_m = 0, reach_b_m = 0;  ///< levers of the odometers
    std::uint32_t body_b = 0;
  };
  /// A static body's share of the odometers.
  struct BodyMotion {
    Vec3 reference_w = Vec3::Zero();
    double swept_m = 0;  ///< sum of the turn times the distance of the grip from the reference
  };
  /// What the gate says of a pair.
  struct Gated {
    double gap_m = 0;      ///< how far apart it is at least
    bool is_far = false;   ///< need not be looked at
    bool renewed = false;  ///< by two supports
  };
  /// A pair that must be looked at, and how near it may be.
  struct Candidate {
    double gap_m = 0;
    std::uint32_t pair = 0;
  };
  /// The nearest of the pairs offered; the lowest index at ties.
  struct Nearest {
    Real d_near_m = std::numeric_limits<Real>::max();
    std::uint32_t pair = 0;
    void offer(std::uint32_t index, Real d_m) noexcept {
      if (d_m < d_near_m || (d_m == d_near_m && index < pair)) *this = {d_m, index};
    }
  };
  /// Depth, nearest C-face and work of a pair over the nodes that carry force.
  struct LiveContact {
    bool searched = false;  ///< else the search over all nodes has them
    NearResult found;
  };

  [[nodiscard]] Odometer odometer(const PairGate& gate) const noexcept;
  [[nodiscard]] Gated pass_gate(std::uint32_t pair, const GripPose& goal) noexcept;
  [[nodiscard]] SearchWork visit(std::uint32_t pair, const GripPose& goal) noexcept;
  [[nodiscard]] SearchWork hold(const Candidate& candidate, const GripPose& goal) noexcept;
  [[nodiscard]] Real held_depth(PairState& pair, const PairPose& pose, Real at_least_m,
                                SearchWork& work) noexcept;
  [[nodiscard]] const PairState* felt_pair(const Nearest& nearest) const noexcept;
  [[nodiscard]] LiveContact live_contact(PairState& pair, const PairPose& pose,
                                         const NearResult& found) noexcept;
  [[nodiscard]] std::uint32_t touch(std::uint32_t pair, const PairPose& pose) noexcept;
  [[nodiscard]] PairPose pose_of(std::uint32_t pair, const GripPose& goal) noexcept;

  std::span<const PairView> views_;
  LawId law_ = LawId::kProxy;
  Real epsilon_m_ = 0;
  double exact_band_m_ = 0;
  Real max_step_m_ = 0, max_turn_rad_ = 0;  ///< motion per tick of the speed certificate; 0: none
  std::uint32_t max_visits_ = 0;
  bool has_seams_ = false;

  std::span<PairState> pairs_;
  std::span<PairGate> gates_;  ///< by pair
  std::span<BodyMotion> bodies_;
  std::span<Real> moving_lanes_;              ///< turned vertices, by moving piece
  std::span<std::size_t> lanes_begin_;        ///< of each moving piece
  std::span<std::uint64_t> lanes_turned_at_;  ///< tick in which each piece was turned
  SearchRoom room_;                           ///< near sets of the pairs visited in this tick
  BoundedList<Candidate> candidates_;
  BoundedList<ContactPatch> patches_;
  BoundedList<Vec3> points_;

  MotionSum motion_;
  GripPose last_;  ///< goal of the last tick
  bool has_last_ = false;
  std::uint64_t tick_ = 0;         ///< since the last reset
  std::uint64_t searched_at_ = 0;  ///< the last search
};

}  // namespace haptic
