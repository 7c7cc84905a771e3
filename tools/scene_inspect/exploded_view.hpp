// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The convex pieces of a scene's bodies pushed apart from the centre of their body, so that the
/// seams between them can be seen, and their file: a Wavefront OBJ with its MTL for any viewer, one
/// group per piece, in metres, static bodies where they stand, the moving part above them.

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
  FaceKind kind = FaceKind::kOpen;
  std::vector<std::vector<Point3>> open;  ///< of a partly covered face: what lies on the surface
};

struct ExplodedPiece {
  std::uint32_t number = 0;  ///< within its body
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

/// A material of an MTL file.
std::string material_line(const std::string& name, const std::array<double, 3>& colour);
/// Colour of a piece, by its number within its body; components 0 to 1.
std::array<double, 3> piece_colour(std::uint32_t number);
/// Colour of faces that lie inside a part.
inline constexpr std::array<double, 3> kSeamColour{0.93, 0.42, 0.16};

/// `material_file` as the OBJ names it. Faces keep their polygons; seam faces have a material of
/// their own.
std::string exploded_obj(const std::vector<ExplodedBody>& bodies, const std::string& material_file);
std::string exploded_mtl(const std::vector<ExplodedBody>& bodies);

}  // namespace haptic::tools
