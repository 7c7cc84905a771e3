// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The scenes of the surface campaign: a part and an obstacle as triangle meshes, their scene file,
/// and its compilation by graph_compiler's own code. A scene of the user's is read the same way.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "host_sim/lab/surface_fuzz/fuzz_meshes.hpp"
#include "tools/graph_compiler/program/scene_file.hpp"

namespace haptic::sim {

/// How the compiler takes a part (key `as` of the scene file).
enum class PartKind : std::uint8_t { kSolid, kSurface };
[[nodiscard]] const char* to_text(PartKind kind);

/// Two meshes of our own and where the device goes; the obstacle stands at the origin of W.
struct SurfaceScene {
  std::string name;
  FuzzMesh part, around;
  PartKind part_as = PartKind::kSolid, around_as = PartKind::kSolid;
  /// With a facet out of reach, so that solids are held apart by the skin of facets.
  bool has_bystander = false;
  double share = 1;  ///< of the ticks; less where they take longer
  /// A way through the obstacle: into its hole where it has one, across the middle of a sheet.
  Vector through_at = Vector::Zero(), through_axis = Vector::UnitZ();

  [[nodiscard]] bool closed() const { return part.closed && around.closed; }
};

/// `count` scenes: first fixed pairs of every kind of mesh, then pairs drawn from `seed`. Where
/// `closed_only`, those whose meshes both bound solids.
[[nodiscard]] std::vector<SurfaceScene> surface_scenes(std::size_t count, std::uint64_t seed,
                                                       bool closed_only);
/// How many fixed pairs there are.
[[nodiscard]] std::size_t fixed_surface_scenes(bool closed_only);

/// A scene that is compiled, and its meshes as their files hold them.
struct CompiledSurface {
  std::string name;
  std::vector<std::byte> blob;
  std::vector<Triangle> moving;  ///< mesh frame of the part, scaled
  std::vector<Triangle> fixed;   ///< all obstacles, W
  double moved_m = 0;  ///< by which the compiler moved corners, of both sides together, at most
  Vector start = Vector::Zero();
};

/// The scene file of a scene of our own; meshes `part.obj` and `around.obj` beside it.
[[nodiscard]] std::string scene_text(const SurfaceScene& scene, double friction,
                                     std::uint32_t passes);

/// Writes a scene of our own into a folder that is removed again, and compiles it.
/// @throws tools::InputError from the compiler.
[[nodiscard]] CompiledSurface compiled_surface(const SurfaceScene& scene, double friction,
                                               std::uint32_t passes);
/// Compiles what a scene file says. @throws as the next.
[[nodiscard]] CompiledSurface compiled_surface(const tools::SceneFile& file);
/// Compiles a scene file, its passes replaced where they are given. Polygons of its meshes are
/// taken as fans, so they must be convex. @throws tools::InputError from the compiler, or for
/// another law than proxy.
[[nodiscard]] CompiledSurface compiled_surface(const std::string& scene_file,
                                               std::optional<std::uint32_t> passes);

}  // namespace haptic::sim
