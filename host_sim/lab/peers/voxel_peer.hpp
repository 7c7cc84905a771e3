// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Points of the part against voxels of what stands, as haptics has rendered parts in six degrees
/// of freedom since 1999. Two forms, both our own code after the papers:
///
/// kTangentPlanes: W. McNeely, K. Puterbaugh, J. Troy, "Six degree-of-freedom haptic rendering
/// using voxel sampling", SIGGRAPH 1999. A point in a surface voxel is pushed along its own normal
/// by its depth below the plane through the voxel's middle; the sum over more than ten points is
/// scaled to ten; the part is a rigid body, stepped once a tick, on a spring and a damper.
///
/// kDistanceField: J. Barbic, D. James, "Six-DoF haptic rendering of contact between geometrically
/// complex reduced deformable models", IEEE Trans. Haptics 1(1), 2008. A point inside is pushed by
/// its depth in a distance field; the part is where spring and contacts are in balance, by one
/// linear solve a tick (static virtual coupling).
///
/// Better for the method than printed: points lie on the surface itself, a tree of balls leaves out
/// points that are far away (1999 has none), and depths beyond the surface voxels count on.

#include <cstddef>
#include <memory>
#include <string>

#include "host_sim/lab/peers/coupled_peer.hpp"
#include "host_sim/lab/peers/distance_field.hpp"

namespace haptic::sim {

enum class VoxelForm : std::uint8_t { kTangentPlanes, kDistanceField };
/// Which way a point of kDistanceField is pushed.
enum class PushAlong : bool { kPointNormal, kGradient };

struct VoxelSettings {
  VoxelForm form = VoxelForm::kTangentPlanes;
  PushAlong along = PushAlong::kPointNormal;
  /// kTangentPlanes: of all contacts together; kDistanceField: of each point.
  double contact_n_per_m = 0;
};

/// Part and surroundings as the method keeps them; made once, for several settings.
class VoxelScene {
 public:
  /// `part`: A's axes about the grip point; `standing`: W; `reach`: where the part can come.
  VoxelScene(std::span<const SurfaceTriangle> part, std::span<const SurfaceTriangle> standing,
             const SpaceBox& reach, double voxel_m, double spacing_m);

  [[nodiscard]] const PointTree& points() const { return points_; }
  /// Fine first.
  [[nodiscard]] std::span<const DistanceField> fields() const { return fields_; }
  /// Layer of each voxel of the finest: 0 free, 1 surface, 2 and on inside.
  [[nodiscard]] std::uint8_t layer(std::size_t voxel) const { return layers_[voxel]; }

 private:
  PointTree points_;
  std::vector<DistanceField> fields_;
  std::vector<std::uint8_t> layers_;
};

/// `scene` outlives it. kTangentPlanes: 50 g, or so much more that contacts and spring are stable
/// at a step a tick, and inertia by the same rule.
[[nodiscard]] std::unique_ptr<CoupledPeer> make_voxel_peer(const VoxelScene& scene,
                                                           const CouplingGains& gains,
                                                           const VoxelSettings& settings);

}  // namespace haptic::sim
