// SPDX-License-Identifier: Apache-2.0
#pragma once
/// From convex pieces to the bytes of a compiled scene: topology tables, contact graph with
/// symmetrised arcs in CSR, capacities, content hash. Needs the core and the standard library
/// alone, so tests of the core use it too.

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "rt_core/scene/scene_format.hpp"
#include "tools/graph_compiler/graph/convex_piece.hpp"

namespace haptic::tools {

/// A body and where it stands. Static: pose of the body frame in W. Moving: ignored but for the
/// start pose.
struct PlacedBody {
  Body body;
  std::array<double, 3> position_m{0, 0, 0};
  std::array<double, 4> quaternion_wxyz{1, 0, 0, 0};
  /// Origin of the body's coordinates in its mesh frame: mesh = body + mesh_origin_m. Lets a part
  /// that lies far from the origin of its file keep coordinates near zero, hence all their digits.
  /// Poses and grip stay in the mesh frame.
  std::array<double, 3> mesh_origin_m{0, 0, 0};
};

/// Everything that a scene file says, after its meshes have become convex pieces.
struct SceneDescription {
  std::string name;
  PlacedBody moving;
  std::vector<PlacedBody> statics;
  std::array<double, 3> grip_m{0, 0, 0};  ///< x_0^A in the moving body's frame
  SceneParameters
      parameters{};  ///< name_offset, name_bytes and start pose are filled by the writer
};

/// Bytes of the scene, kSceneAlignment-aligned offsets, ready for SceneView::open (which has
/// accepted them). Byte-identical for equal input on every compiler. Geometry is rounded to Real
/// once, at the end.
/// @throws InputError when a limit of the format is passed (names piece, count and limit).
std::vector<std::byte> write_scene(const SceneDescription& description);

}  // namespace haptic::tools
