// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Seeded poses of a pair for counts over many situations.

#include "host_sim/shapes/c_obstacle.hpp"

namespace haptic::sim {

struct SweepPose {
  Vector x = Vector::Zero();  ///< grip point = origin of A in W [m]
  Rotation q = Rotation::Identity();
};

class PoseSweep {
 public:
  PoseSweep(const SceneView& view, std::uint64_t seed);

  /// Random orientation; x at `gap_m` over a random point of the C-obstacle's boundary along the
  /// normal of the C-face hit (negative: inside).
  [[nodiscard]] SweepPose generic(double gap_m);
  /// Face of A on a face of B, random yaw and offset, tilted afterwards by `tilt_rad` about a
  /// random axis; `depth_m` inside.
  [[nodiscard]] SweepPose face_face(double depth_m, double tilt_rad);
  /// An edge of A on a face of B, or a face of A on an edge of B, in turn.
  [[nodiscard]] SweepPose edge_face(double depth_m, double tilt_rad);

 private:
  [[nodiscard]] Vector point_of_face(const PieceView& piece, std::uint32_t face);
  [[nodiscard]] Rotation turned(const Vector& from, const Vector& to);
  [[nodiscard]] SweepPose placed(const Rotation& q, const Vector& point_a, const Vector& point_b,
                                 const Vector& normal, double depth_m, double tilt_rad);

  const SceneView& view_;
  FlatPair flat_;
  Seeded random_;
  Vector reference_b_;
  bool edge_of_b_ = false;
};

}  // namespace haptic::sim
