// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The free places of a part that does not turn, as convex cells. At one orientation the C-obstacle
/// of two convex pieces is a convex polyhedron (paper Sec. II); a box about everything is cut along
/// the C-faces, and what lies in a C-obstacle is left out. The cells that remain are all free
/// places, so whether translations lead from one place to another is a question of which cells
/// touch: it is decided, not sampled.
///
/// Places are those of the grip point in W [m]. Each C-face is moved into its C-obstacle by the
/// depth that counts as free, so the cells are closed sets. Limits: pieces with a volume (no
/// surfaces), kMostPairNodes basic contacts of a pair, kMostCells cells; beyond them nothing is
/// decided.

#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "rt_core/scene/scene_view.hpp"
#include "tools/c_space/c_obstacle.hpp"
#include "tools/plan/search/pose_algebra.hpp"

namespace haptic::tools {

inline constexpr std::uint32_t kMostPairNodes = 20'000;
inline constexpr std::size_t kMostPairs = 2'000, kMostCells = 20'000;

/// Lengths that are rounding: corners nearer than this are one, cells that are nearer touch [m].
inline constexpr double kCellRounding_m = HAPTIC_REAL_IS_FLOAT ? 4.0e-7 : 4.0e-9;

/// One side of a cell. Its normal points out of the cell, which lies where normal.x <= offset.
struct CellSide {
  Vec3d normal = Vec3d::Zero();
  double offset_m = 0;
  std::vector<Vec3d> corners;  ///< counter-clockwise seen from outside
};

/// A convex polyhedron.
struct ConvexCell {
  std::vector<CellSide> sides;
  Vec3d low = Vec3d::Zero(), high = Vec3d::Zero();

  /// Largest distance over the planes of its sides; <= 0: inside.
  [[nodiscard]] double outside_m(const Vec3d& x) const;
  [[nodiscard]] double volume_m3() const;
  [[nodiscard]] Vec3d centre() const;  ///< mean of the corners of its sides, inside
};

[[nodiscard]] ConvexCell box_cell(const Vec3d& low, const Vec3d& high);

/// The two parts of a cell on either side of the plane normal.x = offset. A part that is thinner
/// than rounding has no sides, and the other is the whole cell.
struct CutCell {
  ConvexCell below, above;
};
[[nodiscard]] CutCell cut(const ConvexCell& cell, const Vec3d& normal, double offset_m);

[[nodiscard]] double area_m2(std::span<const Vec3d> polygon);
/// The part of a convex polygon with normal.x <= offset.
[[nodiscard]] std::vector<Vec3d> cut_polygon(std::span<const Vec3d> polygon, const Vec3d& normal,
                                             double offset_m);

/// Where two cells touch: a polygon, or a line or a point.
struct Passage {
  std::uint32_t to = 0;
  std::vector<Vec3d> corners;
  Vec3d middle = Vec3d::Zero();
  double area_m2 = 0;
};

/// A C-face and the pair that it is of.
struct PlacedFace {
  std::uint32_t pair = 0;
  CFace face;
};

struct TranslationSpace {
  std::vector<PlacedFace> faces;
  std::vector<ConvexCell> cells;
  std::vector<std::vector<Passage>> passages;  ///< of each cell
  double tolerance_m = 0;                      ///< depth that counts as free
  std::string undecided;  ///< a sentence: a limit is exceeded, and there are no cells

  /// Cells that a place lies in; at a common side several.
  [[nodiscard]] std::vector<std::uint32_t> cells_at(const Vec3d& x) const;
  /// For every cell whether it is joined to one of `from`.
  [[nodiscard]] std::vector<bool> reached_from(std::span<const std::uint32_t> from) const;
};

/// The free places at the orientation of `pose_wa` (mesh frame) in a box about all C-obstacles and
/// `places`, within the scene's workspace. Cost: the C-obstacles of all pairs, and cells times
/// C-faces.
[[nodiscard]] TranslationSpace make_translation_space(const SceneView& scene, const Pose& pose_wa,
                                                      std::span<const Vec3d> places,
                                                      double tolerance_m);

/// Which cells touch which. `least_area_m2` > 0: only those that have so much of a side in common.
[[nodiscard]] std::vector<std::vector<Passage>> passages_of(std::span<const ConvexCell> cells,
                                                            double least_area_m2);

/// A short way from one place to another, both with their cells known, over the middles of
/// passages; empty where none is. The first place is `from`, the last is `to`.
struct CellWay {
  std::vector<Vec3d> places;
  std::vector<std::uint32_t> cells;  ///< between each two places
};
[[nodiscard]] CellWay way_through(const TranslationSpace& space, const Vec3d& from,
                                  const Vec3d& to);

/// A C-face that stands in the way.
struct BlockingFace {
  std::uint32_t pair = 0;
  Vec3d normal_w = Vec3d::Zero();  ///< out of the C-obstacle, towards the part's place
  double offset_m = 0;
  double area_m2 = 0;                ///< of it, that bounds the places that are reached
  std::vector<std::uint32_t> nodes;  ///< its basic contacts
};

/// What encloses a place: all places that translations reach from it, and the C-faces about them.
struct Enclosure {
  Vec3d low = Vec3d::Zero(), high = Vec3d::Zero();
  std::size_t cells = 0;
  std::vector<BlockingFace> faces;  ///< largest area first
};
[[nodiscard]] Enclosure enclosure_of(const TranslationSpace& space, const std::vector<bool>& cells);

}  // namespace haptic::tools
