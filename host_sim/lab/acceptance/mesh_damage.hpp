// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Good meshes of our own, and what export, scanning and conversion do to meshes.

#include <cstdint>
#include <string>
#include <vector>

#include "tools/graph_compiler/mesh/surface.hpp"

namespace haptic::sim {

enum class MeshDamage : std::uint8_t {
  kNone,
  kHoles,       ///< faces taken out
  kFlips,       ///< faces turned round
  kDuplicates,  ///< faces twice, some of them turned round
  kNoise,       ///< every corner of every face moved by up to 1e-6 of the diagonal, each on its own
  kCracks,   ///< some faces cut off from the others and moved away, by 1e-7 to 1e-2 of the diagonal
  kSlivers,  ///< faces without area, and corners inside edges
  kMixed,    ///< two of these
};
inline constexpr std::uint32_t kMeshDamages = 8;
[[nodiscard]] const char* to_text(MeshDamage damage);

/// The same mesh damaged, at random from `seed`; at least a face is left.
[[nodiscard]] tools::RawMesh damaged(const tools::RawMesh& mesh, MeshDamage damage,
                                     std::uint64_t seed);

/// Closed parts of some centimetres: the shapes of the scene file and of surface-fuzz.
[[nodiscard]] std::vector<tools::RawMesh> good_meshes();

/// What a mesh is, counted from the places of its corners alone: no code of the compiler.
struct MeshFacts {
  std::size_t triangles = 0;   ///< of all fans
  std::size_t with_area = 0;   ///< of these, area above 1e-12 of the squared diagonal
  std::size_t open_edges = 0;  ///< pairs of places that one different triangle with area has
  std::size_t not_finite = 0;  ///< corners
  double volume = 0.0;         ///< signed, of all fans
  double diagonal = 0.0;
};
[[nodiscard]] MeshFacts facts_of(const tools::RawMesh& mesh);

}  // namespace haptic::sim
