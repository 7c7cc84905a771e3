// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Seeded poses in which chosen features of two bodies meet: a vertex, edge or face of A against
/// one of B, with the edges turned parallel or not, tilted by a given small angle, at a given gap.

#include <cstdint>
#include <vector>

#include "host_sim/shapes/shapes.hpp"
#include "rt_core/contact/contact_situation.hpp"

namespace haptic::sim {

/// Position of A's origin and orientation.
struct Placement {
  Vector x = Vector::Zero();
  Rotation q = Rotation::Identity();

  [[nodiscard]] Pose pose() const { return pose_at(x, q); }
};

/// A point of a body's surface with a direction in its normal cone and an edge direction there.
struct SurfacePoint {
  Vector point, normal, tangent;
};

/// The surface of a solid to draw points from.
class Surface {
 public:
  explicit Surface(const Solid& solid);

  /// A random feature of the kind, a random point of it and a random direction of its normal cone.
  [[nodiscard]] SurfacePoint draw(FeatureKind kind, Seeded& random) const;
  [[nodiscard]] double reach_m() const { return reach_m_; }  ///< largest distance from the origin
  /// Face whose normal is `n` to 1e-9, or -1.
  [[nodiscard]] int face_along(const Vector& n) const;
  [[nodiscard]] SurfacePoint on_face(std::size_t face, Seeded& random) const;
  [[nodiscard]] std::size_t face_count() const { return normals_.size(); }

 private:
  struct Edge {
    std::uint32_t v0, v1, f0, f1;
  };
  Solid solid_;
  std::vector<Vector> normals_;
  std::vector<Edge> edges_;
  std::vector<std::vector<std::uint32_t>> faces_at_;  ///< by vertex
  double reach_m_ = 0;
};

class ContactPoses {
 public:
  ContactPoses(const Solid& a, const Solid& b) : a_(a), b_(b) {}

  /// The features meet with opposite directions; `parallel`: with their edges parallel, else spun
  /// at random about the normal. Then A is turned by `tilt_rad` about a random axis through the
  /// point; 0 leaves the rotation as computed. `gap_m`: along B's direction, negative inside.
  [[nodiscard]] Placement meet(FeatureKind of_a, FeatureKind of_b, bool parallel, double tilt_rad,
                               double gap_m, Seeded& random) const;
  /// A face of A on a face of B at an orientation of exact half turns where the bodies have such a
  /// pair of faces; else as `meet`.
  [[nodiscard]] Placement lie_exactly(double tilt_rad, double gap_m, Seeded& random) const;
  /// Anywhere within twice the reach of both bodies, any orientation.
  [[nodiscard]] Placement anywhere(Seeded& random) const;
  /// Features of random kinds, generic.
  [[nodiscard]] Placement generic(double gap_m, Seeded& random) const;

  /// Gaps from 5 mm outside to 6 mm inside, now and then zero, of the order of rounding, or deep.
  [[nodiscard]] double draw_gap_m(Seeded& random) const;

 private:
  Surface a_, b_;
};

/// `q` turned by `angle_rad` about `axis` through components of the quaternion: an angle of 1e-16
/// stays what it is. Zero leaves every bit of `q`.
[[nodiscard]] Rotation tilted(const Rotation& q, const Vector& axis, double angle_rad);

[[nodiscard]] FeatureKind draw_kind(Seeded& random);

}  // namespace haptic::sim
