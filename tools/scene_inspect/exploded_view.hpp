// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The convex pieces of a scene's bodies pushed apart from the centre of their body, so that the
/// seams between them can be seen. What the drawing and the OBJ file are made of.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "rt_core/scene/scene_view.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"
#include "tools/scene_inspect/pruning_recheck.hpp"

namespace haptic::tools {

/// Where a face lies.
enum class FaceKind : std::uint8_t {
  kOpen,           ///< on the surface of the part
  kPartlyCovered,  ///< in part on the surface
  kSeam            ///< inside the part: another piece goes on behind it
};

struct ExplodedFace {
  std::vector<Point3> loop;  ///< counter-clockwise from outside [m]
  Point3 normal{};           ///< outward
  FaceKind kind = FaceKind::kOpen;
  std::vector<std::vector<Point3>> open;  ///< of a partly covered face: what lies on the surface
};

struct ExplodedPiece {
  std::uint32_t number = 0;  ///< within its body
  std::uint32_t vertices = 0, edges = 0;
  std::size_t seams = 0, partly_covered = 0;  ///< faces
  double volume_m3 = 0.0;
  Point3 centre{};
  std::vector<ExplodedFace> faces;
  vec::Box box;
};

struct ExplodedBody {
  std::string name;
  bool moving = false;
  Point3 reference_m{};  ///< static: where the geometry's origin stands in W
  std::vector<ExplodedPiece> pieces;
  vec::Box box;
};

/// Every piece is moved by `factor` times the way from the centre of volume of its body to its own
/// middle. Coordinates in the geometry frame of each body [m]; `factor` >= 0.
std::vector<ExplodedBody> exploded_bodies(const SceneView& view,
                                          const std::vector<PieceExposure>& exposure,
                                          double factor);

/// Indices of the pieces from back to front as seen along `-towards_viewer`: a piece never comes
/// before one that it covers, as far as face planes tell; else by the depth of their middles.
std::vector<std::size_t> painting_order(const std::vector<ExplodedPiece>& pieces,
                                        const Point3& towards_viewer);

}  // namespace haptic::tools
