// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Does the moving part start free? A part that starts across a facet or inside a shell of a
/// surface part has no way out that the core could certify.
///
/// Where no facet is crossed: a part is inside a closed shell where the winding number of the shell
/// is not 0. It is inside an open shell (torn, cracked) where the winding number is near a whole
/// number other than 0 and no opening of the shell is as wide as the part; otherwise the shell is a
/// hollow with a mouth (a cup, a tube), and the part may start in it.

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tools/graph_compiler/graph/convex_piece.hpp"
#include "tools/graph_compiler/surface/surface_part.hpp"
#include "tools/graph_compiler/surface/triangle_crossing.hpp"

namespace haptic::tools {

/// A part as triangles where it starts, W frame [m].
struct StartShape {
  std::string mesh;         ///< for messages
  bool is_surface = false;  ///< otherwise the pieces of a solid
  std::vector<TriangleCorners> triangles;
  std::vector<std::int64_t> source_face;  ///< of each triangle, from 0; -1: made by a cut
  std::vector<TriangleCorners> shells;    ///< those that enclose something
  std::vector<Point3> probes;             ///< a point of every part that hangs together
  /// The other facets, triangles that close them, and the holes that these close.
  std::vector<TriangleCorners> open_facets, rim;
  struct Opening {
    double wide_m = 0.0, long_m = 0.0;  ///< nothing larger passes
    Point3 middle_m{0, 0, 0};
  };
  std::vector<Opening> openings;
  /// Points all over parts that hang together, at most kMostSampledParts.
  std::vector<std::vector<Point3>> samples;
  std::array<double, 3> extent_m{0, 0, 0};  ///< along the axes of the mesh, ascending
};

inline constexpr std::size_t kMostSampledParts = 64, kMostPartSamples = 8;

struct StartPose {
  std::array<double, 3> position_m{0, 0, 0};
  std::array<double, 4> quaternion_wxyz{1, 0, 0, 0};
};

/// `account` is that of the part: it tells whether the seams of the surface are tight.
StartShape start_shape(const SurfacePart& part, const SurfaceAccount& account,
                       const StartPose& pose);
/// `origin_m` is that of the body's coordinates in the mesh frame.
StartShape start_shape(const Body& body, const std::array<double, 3>& origin_m,
                       const StartPose& pose);

/// The defect of a start.
struct StartCollision {
  std::size_t fixed = 0;  ///< index of the static part
  bool inside = false;    ///< one lies in the other; otherwise facets cross
  Point3 place_m{0, 0, 0};
  std::int64_t face = -1, fixed_face = -1;  ///< where facets cross
  /// With a surface: the shortest move found that leads to a free pose.
  std::optional<Point3> free_move_m;
};

/// A collision of the start pose that involves a surface part, else one of two solids, else none.
/// With a surface, touching is a collision: its gaps must be positive. Solids may touch.
/// Where facets cross is exact. `free_move_m` is the best of 26 directions and the one between the
/// middles of the boxes, each by bisection between a pose in collision and a free one.
std::optional<StartCollision> start_collision(const StartShape& moving,
                                              const std::vector<StartShape>& fixed);

class StartSearch;

/// The same question at many places. The shapes outlive it.
class StartPlaces {
 public:
  StartPlaces(const StartShape& moving, const std::vector<StartShape>& fixed);
  ~StartPlaces();
  StartPlaces(const StartPlaces&) = delete;
  StartPlaces& operator=(const StartPlaces&) = delete;

  /// Collision of the part moved by `by` from where its shape is, in W; without `free_move_m`.
  /// @param touching_m  above 0: facets that overlap by no more than this touch, and touching is no
  /// collision.
  [[nodiscard]] std::optional<StartCollision> collision(const Point3& by,
                                                        double touching_m = 0.0) const;

  /// Least distance of the moving part from all others; `most_m` where it is not below. 0 where
  /// surfaces cross. Cost: that of a few questions for a collision.
  [[nodiscard]] double distance_m(const Point3& by, double most_m) const;

 private:
  std::unique_ptr<StartSearch> search_;
};

/// "meets face 3 of block.stl with its own face 12 near (0, 0, 0.1) m", with the part before it.
std::string collision_place_text(const StartCollision& collision, const StartShape& fixed);
/// "the part starts across face 3 of block.stl (its own face 12) near (0, 0, 0.1) m; ..." for
/// messages, with the nearest free start position.
std::string start_collision_text(const StartCollision& collision, const StartShape& fixed,
                                 const std::array<double, 3>& position_m);

}  // namespace haptic::tools
