// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/reproduction/pose_sweep.hpp"

#include <limits>

namespace haptic::sim {
namespace {

Vector centre_of(const PieceView& piece) {
  const double* c = piece.record->centre_m;
  return {c[0], c[1], c[2]};
}

Vector normal_of(const PieceView& piece, std::uint32_t face) {
  return piece.face_normal(face).cast<double>();
}

}  // namespace

PoseSweep::PoseSweep(const SceneView& view, std::uint64_t seed)
    : view_(view), flat_(view, 0), random_(seed) {
  const double* r = view.bodies()[flat_.view().b.record->body].reference_m;
  reference_b_ = Vector(r[0], r[1], r[2]);
}

SweepPose PoseSweep::generic(double gap_m) {
  SweepPose pose;
  pose.q = random_.rotation();
  const Vector centre =
      reference_b_ + centre_of(flat_.view().b) - pose.q * centre_of(flat_.view().a);
  const Vector direction = random_.direction();
  flat_.place(place_moving(view_, pose_at(centre, pose.q)));
  double nearest = std::numeric_limits<double>::infinity();
  Vector normal = direction;
  for (std::uint32_t node = 0; node < flat_.node_count(); ++node) {
    const FlatPair::Value value = flat_.evaluate(node);
    if (value.violation_m > kApplicable_m) continue;
    Point n{}, app{};
    flat_.contact(node, n, app);
    const double slope = vector_of(n).dot(direction);
    if (slope <= 0 || -value.depth_m / slope >= nearest) continue;
    nearest = -value.depth_m / slope;
    normal = vector_of(n);
  }
  pose.x = centre + nearest * direction + gap_m * normal;
  return pose;
}

Vector PoseSweep::point_of_face(const PieceView& piece, std::uint32_t face) {
  Vector sum = Vector::Zero();
  double weights = 0;
  for (const std::uint16_t v : piece.face_vertices(face)) {
    const double w = random_.uniform(0.0, 1.0);
    sum += w * piece.vertex(v).cast<double>();
    weights += w;
  }
  return sum / weights;
}

Rotation PoseSweep::turned(const Vector& from, const Vector& to) {
  const Rotation yaw(Eigen::AngleAxisd(random_.uniform(0.0, 6.283185307179586), to));
  return yaw * Rotation::FromTwoVectors(from, to);
}

SweepPose PoseSweep::placed(const Rotation& q, const Vector& point_a, const Vector& point_b,
                            const Vector& normal, double depth_m, double tilt_rad) {
  SweepPose pose;
  pose.q = q;
  if (tilt_rad != 0) pose.q = Rotation(Eigen::AngleAxisd(tilt_rad, random_.direction())) * q;
  pose.x = reference_b_ + point_b - pose.q * point_a - depth_m * normal;
  return pose;
}

SweepPose PoseSweep::face_face(double depth_m, double tilt_rad) {
  const PieceView &a = flat_.view().a, &b = flat_.view().b;
  // One draw per statement: the order of arguments is the compiler's.
  const std::uint32_t face_a = random_.below(a.face_count);
  const std::uint32_t face_b = random_.below(b.face_count);
  const Vector n = normal_of(b, face_b);
  const Rotation q = turned(normal_of(a, face_a), -n);
  const Vector on_a = point_of_face(a, face_a);
  const Vector on_b = point_of_face(b, face_b);
  return placed(q, on_a, on_b, n, depth_m, tilt_rad);
}

SweepPose PoseSweep::edge_face(double depth_m, double tilt_rad) {
  const PieceView &a = flat_.view().a, &b = flat_.view().b;
  edge_of_b_ = !edge_of_b_;
  // A normal in the wedge of the edge's two faces makes the edge the extreme of its body.
  const PieceView& edged = edge_of_b_ ? b : a;
  const EdgeRecord& edge = edged.edges[random_.below(edged.edge_count)];
  const double share = random_.uniform(0.1, 0.9);
  const Vector wedge =
      ((1 - share) * normal_of(edged, edge.face[0]) + share * normal_of(edged, edge.face[1]))
          .normalized();
  const double along = random_.uniform(0.0, 1.0);
  const Vector on_edge = (1 - along) * edged.vertex(edge.vertex[0]).cast<double>() +
                         along * edged.vertex(edge.vertex[1]).cast<double>();
  if (edge_of_b_) {
    const std::uint32_t face = random_.below(a.face_count);
    const Rotation q = turned(normal_of(a, face), -wedge);
    const Vector on_face = point_of_face(a, face);
    return placed(q, on_face, on_edge, wedge, depth_m, tilt_rad);
  }
  const std::uint32_t face = random_.below(b.face_count);
  const Vector n = normal_of(b, face);
  const Rotation q = turned(wedge, -n);
  const Vector on_face = point_of_face(b, face);
  return placed(q, on_edge, on_face, n, depth_m, tilt_rad);
}

}  // namespace haptic::sim
