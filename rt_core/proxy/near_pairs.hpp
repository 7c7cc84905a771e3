// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The pairs of pieces near each other, of all that there are: a list that holds every pair within
/// a range and lasts until the part has come so far that another could have come near. What a pair
/// needs lies in a slot of a pool while it is in the list, and nowhere else.

#include <cstdint>
#include <span>

#include "rt_core/base/arena.hpp"
#include "rt_core/base/bounded_list.hpp"
#include "rt_core/base/pose.hpp"
#include "rt_core/proxy/left_out.hpp"
#include "rt_core/proxy/piece_tree.hpp"
#include "rt_core/scene/proxy_limits.hpp"
#include "rt_core/scene/scene_view.hpp"

namespace haptic {

/// A node of each of the two trees.
struct NodePair {
  std::uint32_t a = 0, b = 0;
};
/// Nodes of the two trees that wait to be looked at: each level of the trees leaves one behind.
inline constexpr std::uint32_t kMostWaiting = 2 * 33 + 1;

/// A pair in a slot.
struct NearPair {
  PairIndex pair = 0;        ///< of the scene
  Real gap_m = 0;            ///< a lower bound of its gap where the list was begun
  std::uint64_t listed = 0;  ///< the last list that it was in; 0: the slot is free
  bool changed = false;      ///< by the last list
  bool pinned = false;       ///< stays in the next list
};

class NearPairs {
 public:
  /// `slots`: pairs that the list can hold.
  /// `screened`: there will be no lists.
  void place(Arena& arena, const SceneView& scene, std::uint32_t slots, bool screened) noexcept;
  /// Builds the trees; `scene` outlives the list. Not for the servo loop.
  void read_scene(const SceneView& scene) noexcept;
  void reset() noexcept;

  /// Begins a list of the pairs that are within `range_m` of each other at `p`; where they are more
  /// than there are slots, of the nearest. Of a piece of A whose lever about the grip point is
  /// shorter than the part's radius the range is by as much shorter, but no less than `least_share`
  /// of it: so a list of a part that turns lasts. `radius_m`: of A about the grip point. Then
  /// `odometer_m`, how far the part has come, has its way over that share, and what its radius
  /// turns by. The list before stays until this one is finished, however far the part goes
  /// meanwhile.
  void begin(const GripPose& p, double odometer_m, Real range_m, Real least_share = 1,
             Real radius_m = 0) noexcept;
  [[nodiscard]] bool is_begun() const noexcept { return next_.begun; }
  /// Goes on with the list that is begun; true: it is finished and takes the place of the one
  /// before. Pairs of that which are in this one keep their slots; `changed` tells the slots that
  /// hold another pair than before, or none any more. `odometer_m`: now. Where there are more pairs
  /// than slots the range shrinks to that of the nearest; where that would be below `least_m`, the
  /// nearest are those that their faces tell: spheres round long pieces overlap where these are far
  /// apart. Cost: a node of one tree
  /// with one of the other for each visit, a gap along a face for each kListVisitsOfUnit, and a
  /// heap's height for each pair that there is no room for; at the end once all slots. The faces of
  /// one pair may come on top of `most_visits`.
  [[nodiscard]] bool go_on(std::uint32_t most_visits, double odometer_m, Real least_m) noexcept;
  [[nodiscard]] std::span<const std::uint32_t> changed() const noexcept {
    return pool_.changed.view();
  }
  /// Of a scene whose facets are screened (proxy/facet_screen.hpp) there are no lists: pairs come
  /// and go one by one.
  [[nodiscard]] bool has(std::uint32_t piece_a, std::uint32_t piece_b) const noexcept {
    return *entry_of(scene_->find_pair(piece_a, scene_->bodies()[0].piece_count + piece_b)) != 0;
  }
  /// The slot of a pair, which need not have had one, `gap_m` a lower bound of its gap; kNoSlot:
  /// all are taken. Cost: O(1).
  [[nodiscard]] std::uint32_t add(std::uint32_t piece_a, std::uint32_t piece_b,
                                  Real gap_m) noexcept;
  /// A pair leaves its slot. Cost: O(slots in use).
  void remove(std::uint32_t slot) noexcept;
  static constexpr std::uint32_t kNoSlot = UINT32_MAX;

  /// The pair of this slot stays in the next list, however far it is.
  void pin(std::uint32_t slot) noexcept { pool_.pairs[slot].pinned = true; }

  /// There may be such pairs: of a scene of solids with more pairs than slots.
  [[nodiscard]] bool may_leave_out() const noexcept {
    return kSceneTraits.many_pairs && used_.left_out.capacity() > 0;
  }
  /// The list had no slot for a pair within the range that it was asked for.
  [[nodiscard]] bool overflowed() const noexcept { return used_.overflowed; }
  /// The part has moved by so much.
  void follow(const Vec3& dx_m, const Vec3& dtheta_rad) noexcept;
  /// Pairs near the part that the list has no slot for.
  [[nodiscard]] std::span<const LeftOut> left_out() const noexcept {
    return may_leave_out() ? used_.left_out.view() : std::span<const LeftOut>{};
  }
  [[nodiscard]] std::span<LeftOut> left_out() noexcept {
    return may_leave_out() ? std::span{used_.left_out.begin(), used_.left_out.size()}
                           : std::span<LeftOut>{};
  }

  /// Of the list that is begun, and of the one in use.
  [[nodiscard]] Real begun_share() const noexcept { return next_.at[0].least_share; }
  [[nodiscard]] Real least_share() const noexcept { return used_.least_share; }
  /// What a motion may still be before a pair that is not in the list touches, by the odometer of
  /// the list [m].
  [[nodiscard]] Real unlisted_m(double odometer_m) const noexcept {
    return static_cast<Real>(used_.clear_until_m - odometer_m);
  }
  /// The slots in use.
  [[nodiscard]] std::span<const std::uint32_t> slots() const noexcept {
    return pool_.listed.view();
  }
  [[nodiscard]] const NearPair& operator[](std::uint32_t slot) const noexcept {
    return pool_.pairs[slot];
  }
  /// Nodes of the two trees that the list has looked at so far, each with one of the other.
  [[nodiscard]] std::uint32_t visited() const noexcept { return next_.visited; }
  [[nodiscard]] bool holds(std::uint32_t slot) const noexcept {
    return pool_.pairs[slot].listed == used_.number;
  }

 private:
  /// A pair within the range of the list that is begun.
  struct Found {
    PairIndex pair = 0;
    Real gap_m = 0;
    Real rank_m = 0;               ///< over the share of its piece of A
    Real along_m = 0;              ///< along `normal_w`, a lower bound
    Vec3 normal_w = Vec3::Zero();  ///< of the face with the largest gap; zero: not asked for
  };

  struct Place {
    GripPose p;
    Mat3 turn_abs = Mat3::Identity();  ///< of p, by element
    Mat3 turn_back = Mat3::Identity(),
         turn_back_abs = Mat3::Identity();  ///< the same of its inverse
    Real rounding_m = 0;                    ///< of a gap between boxes
    Real radius_m = 0;                      ///< of A about the grip point
    Real least_share = 1;                   ///< of the range
  };
  /// The box of a node of A, along the axes of W.
  struct PlacedBox {
    PieceBox box_w;
    std::uint64_t list = 0;  ///< the last list that has asked for it
  };

  /// A piece that is a facet, as its plane and corners in its body's axes; no corners: it is not.
  struct FlatPiece {
    Vec3 normal = Vec3::Zero();
    Real offset_m = 0;
    const Real* corners = nullptr;
    std::uint32_t corner_count = 0;
    Vec3 reference_m = Vec3::Zero();  ///< of its body
  };

  void take(Found found) noexcept;
  void refine(Found& found) noexcept;
  void ask_edges(Found& found, const PairView& view, const Vec3& y_w) noexcept;
  void refine_next() noexcept;
  [[nodiscard]] bool is_refining() const noexcept { return may_leave_out() && next_.refining; }
  [[nodiscard]] bool has_to_refine() const noexcept {
    return is_refining() && next_.refined < next_.found.size();
  }
  [[nodiscard]] LeftOut left_out_of(const Found& found) const noexcept;
  void leave_out(const Found& found) noexcept;
  void finish(double odometer_m) noexcept;
  void put(const Found& found, std::uint32_t& cursor) noexcept;
  [[nodiscard]] std::uint32_t place_of(PairIndex pair) const noexcept;
  [[nodiscard]] const std::uint32_t* entry_of(PairIndex pair) const noexcept;
  [[nodiscard]] std::uint32_t* entry_of(PairIndex pair) noexcept;
  void fill_table() noexcept;
  [[nodiscard]] Real facet_gap(std::uint32_t piece_a, std::uint32_t piece_b, Real gap_m,
                               Real limit_m) const noexcept;
  [[nodiscard]] Real share_of(std::uint32_t node_a) const noexcept;
  [[nodiscard]] bool is_beyond(std::uint32_t node_a, std::uint32_t node_b, Real share,
                               Real& gap_m) noexcept;
  [[nodiscard]] const PieceBox& box_w(std::uint32_t node_a) noexcept;

  /// Pieces of the scene.
  struct Pieces {
    PieceTree tree_a, tree_b;
    std::span<PieceSphere> spheres;  ///< of all
    std::span<PieceBox> boxes;       ///< of all, where some are facets
    std::span<FlatPiece> flat;       ///< the same
  };
  /// The slots, between lists.
  struct SlotPool {
    std::span<NearPair> pairs;                ///< by slot
    BoundedList<std::uint32_t> listed, free;  ///< slots
    BoundedList<std::uint32_t> changed;       ///< by the last list
    std::span<std::uint32_t> table;           ///< slot + 1 by pair, open addressing; 0: none
  };
  /// The list in use.
  struct UsedList {
    std::uint64_t number = 0;       ///< counts the lists
    double clear_until_m = 0;       ///< reading at which a pair that is not in it may touch
    BoundedList<LeftOut> left_out;  ///< where a scene has more pairs than slots
    bool overflowed = false;        ///< it had no slot for a pair within its range
    Real least_share = 1;           ///< of its range
  };
  /// The list that is begun.
  struct NextList {
    bool begun = false;           ///< there is one
    std::uint64_t number = 0;     ///< counts those that were begun
    std::span<Place> at;          ///< one: where
    std::span<PlacedBox> placed;  ///< by node of A, where some pieces are facets
    double odometer_m = 0;        ///< there
    Real range_m = 0;
    Real left_m = 0, left2 = 0;  ///< nearest pair that is not in it; squared, of those by boxes
    std::span<NodePair> waiting;
    std::uint32_t waiting_count = 0;
    std::uint32_t visited = 0;
    BoundedList<Found> found;  ///< once full a heap with the farthest on its top
    BoundedList<LeftOut> leaving;
    bool refining = false;      ///< there are more than slots: gaps are asked along faces
    bool leaves_pairs = false;  ///< for want of slots
    std::uint32_t refined = 0;  ///< of `found`
  };

  const SceneView* scene_ = nullptr;
  Pieces pieces_;
  SlotPool pool_;
  UsedList used_;
  NextList next_;
};

}  // namespace haptic
