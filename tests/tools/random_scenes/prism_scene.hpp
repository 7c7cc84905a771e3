// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Random closed meshes: unions of boxes and upright prisms with holes through them, on a grid
/// whose columns are pushed out of line, turned in space for every second seed.

#include "tests/tools/random_scenes/mesh_oracle.hpp"
#include "tools/graph_compiler/mesh/surface.hpp"

namespace haptic::tools::test {

/// Small generator of its own: the same numbers on every platform.
class SceneRandom {
 public:
  explicit SceneRandom(std::uint64_t seed) : state_(seed * 0x9e3779b97f4a7c15ULL + 1) {}
  /// In [0, 1).
  double unit();
  /// In [low, high].
  int between(int low, int high);

 private:
  std::uint64_t state_;
};

/// A part and its uncut mesh: the same vertices, faces as quads for the compiler, as triangles for
/// the oracle. About 0.1 m wide.
struct PrismScene {
  RawMesh mesh;
  OracleMesh oracle;
  int genus = 0;  ///< handles, summed over shells
};

/// Never convex, one or more solids that do not touch each other.
PrismScene prism_scene(std::uint64_t seed);

/// Turns and moves a point: quaternion (w, x, y, z) of any length, then the position.
OraclePoint moved(const OraclePoint& p, const std::array<double, 4>& q,
                  const OraclePoint& position);

}  // namespace haptic::tools::test
