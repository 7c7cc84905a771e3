// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Certifies most pairs of facets in bulk. For each triangle of A it lists the facets of the
/// obstacles that are near, eight to a block, each with one plane fixed in W that has the two on
/// either side. Along such a plane a step is judged by the corners of the triangle at its end:
/// eight pairs at a time, in single precision about a point beside the triangle. A pair that no
/// such plane certifies is one for the law (it is "missed"), and is in no list while the law has
/// it.
///
/// What holds between two calls, for the pose p of the last accepted step: every facet that is in
/// no list of a triangle, nor the law's, is farther from it than the row's slack; every other one
/// has a gap along its plane of the row's `least_` or `beyond_` at least.

#include <cstdint>
#include <span>

#include "rt_core/base/arena.hpp"
#include "rt_core/base/bounded_list.hpp"
#include "rt_core/base/float_lanes.hpp"
#include "rt_core/base/pose.hpp"
#include "rt_core/proxy/facet_tree.hpp"
#include "rt_core/proxy/screen_rows.hpp"
#include "rt_core/proxy/way_gap.hpp"
#include "rt_core/scene/scene_view.hpp"
#include "rt_core/scene/screen_size.hpp"

namespace haptic {

/// A pair that the screen cannot certify.
struct ScreenMiss {
  std::uint32_t row = 0;
  std::uint32_t piece_a = 0, facet = 0;  ///< of A, and of the obstacles, both from 0
  Real gap_m = 0;                        ///< at p, a lower bound
};

class NearPairs;

class FacetScreen {
 public:
  /// True if a scene is screened: every piece is a facet, and there are many pairs.
  [[nodiscard]] static bool serves(const SceneView& scene) noexcept;
  /// Room for all of a scene that is.
  void place(Arena& arena, const SceneView& scene) noexcept;
  /// Not for the servo loop.
  void read_scene(const SceneView& scene) noexcept;
  void reset() noexcept;

  /// Looks up again the rows whose slack is below `need_m`, those with least of it first, until
  /// `most_work` is spent: facets up to `range_m` away are listed, with a gap of `least_m` at p, or
  /// missed where no plane has that. Pairs that `taken` has are the law's.
  void renew(const GripPose& p, Real need_m, Real range_m, Real least_m, std::uint32_t most_work,
             const NearPairs& taken) noexcept;

  /// A step from p to q.
  struct Way {
    const GripPose& p;
    const GripPose& q;
    Vec3 dx_m = Vec3::Zero(), dtheta_rad = Vec3::Zero();
    Real far_m = 0, turn_rad = 0;  ///< lengths of these
    Real least_m = 0;              ///< gap that it may end with
    Real dip_m = 0;                ///< by so much less on the way
  };
  /// Judges all pairs of the lists on a way, by their planes, which hold at p: those with a gap
  /// below what it asks for at an end are lost, until search() finds others. Between the ends a
  /// corner leaves its chord by lever theta^2 / 8 at the most; what that is beyond `dip_m` comes on
  /// top of the least. Cost: all rows and blocks, at most.
  void sweep(const Way& way) noexcept;
  enum class Search : std::uint8_t { kDone, kMisses, kSpent };
  /// Finds planes for lost pairs that have such gaps at both ends, those that lack most first.
  /// kDone: there are no more. kMisses: some may be left; then as after kDone misses() have no such
  /// plane, and it goes on once they are certified. kSpent: `most_work` did not do.
  [[nodiscard]] Search search(const Way& way, std::uint32_t most_work) noexcept;
  [[nodiscard]] std::span<const ScreenMiss> misses() const noexcept { return lost_.misses.view(); }
  /// The law has taken a missed pair.
  void drop(const ScreenMiss& miss) noexcept { drop(miss.row, b_.number[miss.facet]); }
  /// It has no room for one that renew() has missed: no step is longer than its gap.
  void refuse(const ScreenMiss& miss) noexcept;

  /// p has gone to q by so much. What search() has ended is known there, else planes that do not
  /// hold may be among them until settle().
  void accept(const GripPose& q, Real far_m, Real turn_rad) noexcept;
  /// A step that search() has ended is not made, or what it missed is not certified.
  void forget_end() noexcept { end_.known = end_.done = false; }
  /// What search() has missed is not certified.
  void forget_done() noexcept { end_.done = false; }
  [[nodiscard]] bool is_settled() const noexcept { return settled_; }
  /// All planes hold at p with what search() was asked for, or are missed.
  void settle() noexcept { settled_ = true; }

  /// A pair goes back to the lists of its triangles; false: no plane at p has a gap of `least_m`.
  [[nodiscard]] bool take_back(std::uint32_t piece_a, std::uint32_t facet_of_scene,
                               const GripPose& p, Real least_m) noexcept;

  /// A lower bound of the gap of what is listed, and of what is neither listed nor the law's.
  [[nodiscard]] Real nearest_m() const noexcept { return nearest_m_; }
  [[nodiscard]] Real clear_m() const noexcept { return clear_m_; }
  /// The last renewal has had too few blocks.
  [[nodiscard]] bool is_full() const noexcept { return lists_.is_full; }
  /// Work since the last call, in kScreenOfUnit of a unit.
  [[nodiscard]] std::uint32_t take_work() noexcept {
    const std::uint32_t work = work_;
    work_ = 0;
    return work;
  }

 private:
  using Row = ScreenRow;
  using Lost = ScreenLost;
  /// Directions of a triangle, along the axes of A.
  struct Shape {
    Vec3 normal = Vec3::Zero();                                    ///< unit
    Vec3 outward[3] = {Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};  ///< in its plane, off its edges
  };
  /// A pair whose plane turns on the way: its plane at q, which it gets once p is there.
  struct Turned {
    std::uint32_t row = 0, block = 0, lane = 0, facet = 0;
    Vec3 normal_w = Vec3::Zero();
  };
  /// A row at a pose.
  struct Placed {
    Vec3 corner_w[3] = {Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
  };
  struct Plane {
    Vec3 normal_w = Vec3::Zero();
    Real gap_p_m = 0, gap_q_m = 0;
    [[nodiscard]] Real worth_m() const noexcept { return gap_p_m < gap_q_m ? gap_p_m : gap_q_m; }
  };
  /// A row and a facet between which a plane is looked for, with a gap of `need_m` at p, and at q
  /// where that is given.
  struct Between {
    std::uint32_t row = 0, facet = 0;
    const GripPose* p = nullptr;
    const GripPose* q = nullptr;
    const Placed* at_p = nullptr;
    const Placed* at_q = nullptr;
    Real need_m = 0;
  };
  /// Planes that were tried between two facets.
  struct Tried {
    Plane best;       ///< at both ends
    WayEnds of_a;     ///< the face of A's triangle at either end
    WayEnds closest;  ///< the directions between closest points
    WayEnds ends;     ///< the best at either end
  };
  /// A plane in a block, and its facet.
  struct Lane {
    float normal[3] = {}, height_m = 0;
    std::uint32_t facet = kNoFacet;
  };
  /// A list of blocks that is being filled.
  struct Chain {
    std::uint32_t block = kNoFacet;    ///< the one that is filled now
    std::uint32_t used = kFloatLanes;  ///< of it
    float least_m = 3.0e38f;
  };
  /// A row that is looked up.
  struct LookUp {
    TriangleShape at;
    bool moves = false;  ///< its origin is another one
    Real range_m = 0, least_m = 0;
    Real others_m = 0;  ///< what is in no list is no nearer
    std::uint32_t found = 0;
    Chain near, far;
  };

  void order_pieces(const SceneView& scene) noexcept;
  [[nodiscard]] std::uint32_t read_triangles(const PieceView& view, std::uint32_t piece,
                                             std::uint32_t begin) noexcept;
  void read_facet(const SceneView& scene, std::uint32_t piece, StaticFacet& facet,
                  std::uint32_t begin) noexcept;
  [[nodiscard]] static Vec3 middle_of(const Placed& at) noexcept;
  [[nodiscard]] static Real radius_of(const Placed& at) noexcept;
  [[nodiscard]] static bool is_far_from_origin(const Row& row, const Placed& at,
                                               Real range_m) noexcept;
  void set_rounding(std::uint32_t number, const Placed& at, Real range_m) noexcept;
  [[nodiscard]] std::span<const Vec3> corners_of(std::uint32_t facet) const noexcept {
    return b_.corners_w.subspan(b_.facets[facet].begin, b_.facets[facet].count);
  }
  [[nodiscard]] Real gap_along(const Vec3& normal_w, const Placed& at,
                               std::uint32_t facet) const noexcept;
  [[nodiscard]] static Placed placed(const Row& row, const GripPose& p) noexcept;
  /// The row of the lanes that a search is at, placed at both ends of the way.
  struct LostRow {
    std::uint32_t row = kNoFacet;
    bool is_move = false;  ///< the ends differ
    Placed at_p{}, at_q{};
    Real needed_m = 0;  ///< gap that a fixed plane must have at both ends
  };
  [[nodiscard]] std::uint32_t worst_lost(float need_m) noexcept;
  [[nodiscard]] bool certify_lost(const Lost& lost, std::uint32_t facet, const LostRow& at,
                                  const Way& way, Tried& tried) noexcept;
  [[nodiscard]] bool find_plane(const Between& between, Tried& tried) noexcept;
  [[nodiscard]] bool fits_batch(std::uint32_t facet) const noexcept;
  void gather(PlaneBatch& batch, std::uint32_t row, std::uint32_t facet, const GripPose& p,
              const GripPose* q) const noexcept;
  [[nodiscard]] Search search_lost(const Way& way, std::uint32_t most_work) noexcept;
  [[nodiscard]] bool search_faces(const Way& way, bool is_move, std::uint32_t most_work) noexcept;
  [[nodiscard]] Lane lane_of(const PlaneBatch& batch, std::uint32_t k, const Row& row,
                             std::uint32_t facet) const noexcept;
  void search_batch(PlaneBatch& batch, std::uint32_t begin, std::uint32_t count, const Way& way,
                    bool is_move) noexcept;
  void put_batch(PlaneBatch& batch, const std::uint32_t* facets, std::uint32_t number,
                 const GripPose& p, LookUp& look) noexcept;
  void put_alone(std::uint32_t number, std::uint32_t facet, const GripPose& p,
                 LookUp& look) noexcept;
  [[nodiscard]] bool find_closest(const Placed& at, const Between& between, Tried& tried) noexcept;
  Plane try_plane(const Vec3& normal_w, const Between& between, Tried& tried) const noexcept;
  [[nodiscard]] Vec3 closest_w(const Placed& at, std::uint32_t facet) const noexcept;
  [[nodiscard]] bool turns_past(const Row& row, Real lever_m, const Way& way, const Tried& tried,
                                Vec3& normal_q_w) const noexcept;
  [[nodiscard]] Lane plane_lane(const Row& row, std::uint32_t facet,
                                const Vec3& normal_w) const noexcept;
  void write(std::uint32_t block, std::uint32_t at, const Lane& lane) noexcept;
  void clear_block(std::uint32_t block) noexcept;
  [[nodiscard]] bool append(Row& row, Chain& chain, const Lane& lane, Real gap_m) noexcept;
  void drop(std::uint32_t number, std::uint32_t facet) noexcept;
  [[nodiscard]] bool is_unlisted(std::uint32_t number) const noexcept;
  void keep_listed(std::uint32_t number, LookUp& look) noexcept;
  void add_found(std::uint32_t number, const GripPose& p, const NearPairs& taken,
                 LookUp& look) noexcept;
  void put(Row& row, LookUp& look, const Lane& lane, Real gap_m) noexcept;
  void look_up(std::uint32_t row, const GripPose& p, Real range_m, Real least_m,
               const NearPairs& taken) noexcept;
  void shed() noexcept;
  struct Due {
    std::uint32_t row = 0;
    bool is_bent = false;  ///< it is judged at both ends
    float need_m = 0;
  };
  void sweep_row(const Due& due, const Way& way) noexcept;
  [[nodiscard]] Real excess_m(std::uint32_t row, const Way& way) const noexcept;
  struct alignas(32) Group {
    float x[kFloatLanes];
  };
  [[nodiscard]] static float& of(std::span<Group> list, std::uint32_t row) noexcept {
    return list[row / kFloatLanes].x[row % kFloatLanes];
  }
  /// The triangles of A, a row each; from the scene but for what a Row says of lists.
  struct Triangles {
    std::span<Row> rows;
    std::span<Shape> shape;             ///< by row
    std::span<std::uint32_t> piece;     ///< by row
    std::span<std::uint32_t> first;     ///< row by piece of A; the others of a piece follow
    std::span<std::uint32_t> in_order;  ///< pieces of A as they follow each other
    std::span<Group> lever_m;           ///< by row: about the grip point
    Real lever_most_m = 0;              ///< of all rows
  };
  /// The facets of the obstacles, from the scene, by their number in the tree, and a query of it.
  struct Obstacles {
    std::span<StaticFacet> facets;
    std::span<Vec3> corners_w;        ///< of the facets
    std::span<std::uint32_t> number;  ///< in the tree, by facet of the obstacles
    FacetTree tree;
    std::span<std::uint32_t> found, mark;  ///< by facet: those that a query has found
    std::uint32_t stamp = 0;
  };
  /// Lower bounds by row: at p from call to call, at q from a sweep to the next.
  struct RowGaps {
    std::span<Group> slack_m;                ///< nothing that is not listed is nearer at p
    std::span<Group> least_m, beyond_m;      ///< smallest gap at p, of those near, of the others
    std::span<Group> least_q_m, beyond_q_m;  ///< the same at q of the last sweep
  };
  /// From call to call.
  struct Lists {
    std::span<ScreenBlock> blocks;
    std::span<ScreenLanes> lanes;   ///< by block
    std::span<std::uint32_t> next;  ///< block of the row, by block, or kNoFacet
    BoundedList<std::uint32_t> free;
    Real most_range_m = 0;  ///< of any, from the scene
    Real range_m = 0;       ///< of those made last
    bool is_full = false;   ///< blocks have run out
  };
  /// Pairs that the last sweep has found to have too small a gap, and how far the search for planes
  /// is.
  struct LostPairs {
    BoundedList<Due> due;  ///< rows of the sweep
    BoundedList<Lost> pairs;
    BoundedList<Turned> turned;
    bool has_faces = false;      ///< those that a face parts have another plane
    std::uint32_t left = 0;      ///< the others, which come first
    std::uint32_t searched = 0;  ///< of these
    float worst_m = 0;           ///< least gap of the others
    float need_m = 0;            ///< what the last sweep asked for
    bool overflowed = false;     ///< not all that were lost are in it
    BoundedList<ScreenMiss> misses;
  };
  /// End of the way of the last sweep.
  struct WayEnd {
    GripPose q;          ///< of least_q_m
    bool known = false;  ///< these hold there
    bool done = false;   ///< and nothing is lost there
  };

  Triangles a_;
  Obstacles b_;
  RowGaps gaps_;
  Lists lists_;
  LostPairs lost_;
  WayEnd end_;
  bool is_wide_ = false;  ///< the processor has eight lanes
  bool settled_ = true;
  Real clear_m_ = 0, nearest_m_ = 0;
  std::uint32_t work_ = 0;
};

}  // namespace haptic
