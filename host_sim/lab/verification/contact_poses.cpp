// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/verification/contact_poses.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

namespace haptic::sim {
namespace {

Vector across(const Vector& direction, const Vector& normal) {
  const Vector flat = direction - normal * normal.dot(direction);
  return flat.norm() > 1e-9 ? Vector(flat.normalized()) : Vector(normal.unitOrthogonal());
}

/// Axes (tangent, normal x tangent, normal) as columns.
Eigen::Matrix3d frame_of(const Vector& tangent, const Vector& normal) {
  Eigen::Matrix3d frame;
  frame.col(0) = tangent;
  frame.col(1) = normal.cross(tangent);
  frame.col(2) = normal;
  return frame;
}

}  // namespace

Surface::Surface(const Solid& solid) : solid_(solid), faces_at_(solid.vertices.size()) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> open;
  for (std::uint32_t f = 0; f < solid.loops.size(); ++f) {
    const std::vector<std::uint32_t>& loop = solid.loops[f];
    Vector sum = Vector::Zero();
    const Vector& origin = solid.vertices[loop[0]];
    for (std::size_t k = 0; k < loop.size(); ++k) {
      const std::uint32_t from = loop[k], to = loop[(k + 1) % loop.size()];
      sum += (solid.vertices[from] - origin).cross(solid.vertices[to] - origin);
      faces_at_[from].push_back(f);
      const auto known = open.find({to, from});
      if (known == open.end()) {
        open[{from, to}] = f;
      } else {
        edges_.push_back({from, to, f, known->second});
      }
    }
    normals_.push_back(sum.normalized());
  }
  for (const Vector& v : solid.vertices) reach_m_ = std::max(reach_m_, v.norm());
}

SurfacePoint Surface::on_face(std::size_t face, Seeded& random) const {
  const std::vector<std::uint32_t>& loop = solid_.loops[face];
  const std::uint32_t k = random.below(static_cast<std::uint32_t>(loop.size()));
  const Vector edge = solid_.vertices[loop[(k + 1) % loop.size()]] - solid_.vertices[loop[k]];
  Vector point = Vector::Zero();
  double total = 0;
  for (const std::uint32_t v : loop) {
    const double weight = random.uniform(0.0, 1.0);
    point += weight * solid_.vertices[v];
    total += weight;
  }
  return {point / total, normals_[face], across(edge, normals_[face])};
}

SurfacePoint Surface::draw(FeatureKind kind, Seeded& random) const {
  if (kind == FeatureKind::kFace)
    return on_face(random.below(static_cast<std::uint32_t>(normals_.size())), random);
  if (kind == FeatureKind::kEdge) {
    const Edge& e = edges_[random.below(static_cast<std::uint32_t>(edges_.size()))];
    const double t = random.uniform(0.0, 1.0), s = random.uniform(0.0, 1.0);
    const Vector along = solid_.vertices[e.v1] - solid_.vertices[e.v0];
    const Vector normal = ((1 - s) * normals_[e.f0] + s * normals_[e.f1]).normalized();
    return {solid_.vertices[e.v0] + t * along, normal, across(along, normal)};
  }
  const std::uint32_t v = random.below(static_cast<std::uint32_t>(solid_.vertices.size()));
  Vector normal = Vector::Zero();
  for (const std::uint32_t f : faces_at_[v]) normal += random.uniform(0.01, 1.0) * normals_[f];
  normal.normalize();
  return {solid_.vertices[v], normal, across(random.direction(), normal)};
}

int Surface::face_along(const Vector& n) const {
  for (std::size_t f = 0; f < normals_.size(); ++f) {
    if ((normals_[f] - n).norm() < 1e-9) return static_cast<int>(f);
  }
  return -1;
}

Placement ContactPoses::meet(FeatureKind of_a, FeatureKind of_b, bool parallel, double tilt_rad,
                             double gap_m, Seeded& random) const {
  const SurfacePoint a = a_.draw(of_a, random), b = b_.draw(of_b, random);
  Vector tangent = b.tangent;
  if (!parallel) {
    const double spin = random.uniform(0.0, 2 * std::numbers::pi);
    tangent = std::cos(spin) * b.tangent + std::sin(spin) * b.normal.cross(b.tangent);
  } else if (random.below(2) == 0) {
    tangent = -tangent;
  }
  const Eigen::Matrix3d r =
      frame_of(tangent, -b.normal) * frame_of(a.tangent, a.normal).transpose();
  Placement placed;
  placed.q = tilted(Rotation(r).normalized(), random.direction(), tilt_rad);
  placed.x = (b.point - placed.q * a.point) + gap_m * b.normal;
  return placed;
}

Placement ContactPoses::lie_exactly(double tilt_rad, double gap_m, Seeded& random) const {
  constexpr int kTries = 24;
  for (int attempt = 0; attempt < kTries; ++attempt) {
    const std::uint32_t turn = random.below(4);
    const Rotation q(turn == 0 ? 1 : 0, turn == 1 ? 1 : 0, turn == 2 ? 1 : 0, turn == 3 ? 1 : 0);
    const std::uint32_t face_b = random.below(static_cast<std::uint32_t>(b_.face_count()));
    const SurfacePoint b = b_.on_face(face_b, random);
    const int face_a = a_.face_along(q.conjugate() * Vector(-b.normal));
    if (face_a < 0) continue;
    const SurfacePoint a = a_.on_face(static_cast<std::size_t>(face_a), random);
    Placement placed;
    placed.q = tilted(q, random.direction(), tilt_rad);
    placed.x = (b.point - placed.q * a.point) + gap_m * b.normal;
    return placed;
  }
  return meet(FeatureKind::kFace, FeatureKind::kFace, true, tilt_rad, gap_m, random);
}

Placement ContactPoses::anywhere(Seeded& random) const {
  const double reach = 2 * (a_.reach_m() + b_.reach_m());
  Placement placed;
  placed.q = random.rotation();
  placed.x = Vector(random.uniform(-reach, reach), random.uniform(-reach, reach),
                    random.uniform(-reach, reach));
  return placed;
}

Placement ContactPoses::generic(double gap_m, Seeded& random) const {
  const FeatureKind of_a = draw_kind(random), of_b = draw_kind(random);
  return meet(of_a, of_b, false, random.uniform(0.0, 0.1), gap_m, random);
}

double ContactPoses::draw_gap_m(Seeded& random) const {
  const double share = random.uniform(0.0, 1.0);
  if (share < 0.10) return 0.0;
  if (share < 0.25) {
    const double sign = random.below(2) == 0 ? 1.0 : -1.0;
    return sign * std::pow(10.0, random.uniform(-17.0, -4.0));
  }
  if (share < 0.45) return random.uniform(-1e-3, 1e-3);
  if (share < 0.70) return random.uniform(-6e-3, 0.0);
  if (share < 0.90) return random.uniform(0.0, 5e-3);
  return random.uniform(-0.5 * (a_.reach_m() + b_.reach_m()), 0.0);
}

Rotation tilted(const Rotation& q, const Vector& axis, double angle_rad) {
  if (angle_rad == 0) return q;
  const Vector half = std::sin(0.5 * angle_rad) * axis;
  return (Rotation(std::cos(0.5 * angle_rad), half[0], half[1], half[2]) * q).normalized();
}

FeatureKind draw_kind(Seeded& random) {
  constexpr FeatureKind kKinds[] = {FeatureKind::kVertex, FeatureKind::kEdge, FeatureKind::kFace};
  return kKinds[random.below(3)];
}

}  // namespace haptic::sim
