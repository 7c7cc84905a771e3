// SPDX-License-Identifier: Apache-2.0
#include "tests/support/proxy_bench.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace haptic::test {
namespace {

/// Smallest height of A less the largest of B along `n`, over all vertices.
Real gap_along(const PairView& pair, const GripPose& pose, const Vec3& y_w, const Vec3& n) {
  const Vec3 in_a = pose.r_wa.transpose() * n;
  Real low = std::numeric_limits<Real>::max(), high = -low;
  for (std::uint32_t v = 0; v < pair.a.vertex_count; ++v) {
    low = std::min(low, in_a.dot(pair.a.vertex(v)));
  }
  for (std::uint32_t v = 0; v < pair.b.vertex_count; ++v) {
    high = std::max(high, n.dot(pair.b.vertex(v)));
  }
  return n.dot(y_w) + low - high;
}

}  // namespace

tools::SceneDescription proxy_scene_of(const tools::Body& moving,
                                       const std::vector<tools::Body>& statics, double friction) {
  tools::SceneDescription description = scene_of(moving, statics);
  description.parameters.law = LawId::kProxy;
  for (tools::PlacedBody& body : description.statics) body.friction = friction;
  return description;
}

GripPose grip_pose(const Point& p, const std::array<double, 4>& q) {
  GripPose pose;
  pose.x0_w = Vec3(static_cast<Real>(p[0]), static_cast<Real>(p[1]), static_cast<Real>(p[2]));
  pose.q_wa = Quat(static_cast<Real>(q[0]), static_cast<Real>(q[1]), static_cast<Real>(q[2]),
                   static_cast<Real>(q[3]))
                  .normalized();
  pose.r_wa = pose.q_wa.toRotationMatrix();
  return pose;
}

double tolerance_n(const LoadedScene& scene) {
  double radius = 0, extent = 0;
  for (const PieceRecord& piece : scene.view.pieces()) {
    (piece.body == 0 ? radius : extent) =
        std::max(piece.body == 0 ? radius : extent, piece.reach_m);
  }
  const CouplingParameters& c = scene.view.parameters().coupling;
  const ProxyScale scale = proxy_scale(static_cast<Real>(radius), static_cast<Real>(extent),
                                       static_cast<Real>(c.tolerance_m));
  // A turn by the tolerance at r_A pulls as much as one of L^2 / r_A^2 of it along.
  const double share = c.k_r_nm_per_rad / (c.k_t_n_per_m * radius * radius);
  return c.k_t_n_per_m * static_cast<double>(scale.tolerance_m) * std::max(1.0, share);
}

ProxyBench::ProxyBench(const tools::SceneDescription& description, std::uint32_t passes)
    : scene(description) {
  const SceneView& view = scene.view;
  const auto pairs = static_cast<std::uint32_t>(view.pair_count());
  NearScratch::Size size;
  for (std::uint32_t i = 0; i < pairs; ++i) {
    views_.push_back(view.pair(i));
    size.fit(*views_[i].a.record, *views_[i].b.record);
  }
  const auto lay_out = [&](Arena& arena) {
    proxy.place(arena, view);
    scratch_.place(arena, size);
  };
  Arena counting;
  lay_out(counting);
  memory_.resize(counting.used() / 8 + 2);
  Arena arena(reinterpret_cast<std::byte*>(memory_.data()));
  lay_out(arena);
  Real radius = 0, extent = 0;
  for (std::uint32_t i = 0; i < pairs; ++i) {
    radius = std::max(radius, static_cast<Real>(views_[i].a.record->reach_m));
    extent = std::max(extent, static_cast<Real>(views_[i].b.record->reach_m));
  }
  proxy.read_scene(view);
  const CouplingParameters& c = view.parameters().coupling;
  parameters.spring.k_t_n_per_m = static_cast<Real>(c.k_t_n_per_m);
  parameters.spring.k_r_nm_per_rad = static_cast<Real>(c.k_r_nm_per_rad);
  parameters.spring.length_m =
      std::sqrt(parameters.spring.k_r_nm_per_rad / parameters.spring.k_t_n_per_m);
  parameters.scale =
      proxy_scale(radius, extent, 0, static_cast<Real>(view.parameters().coupling.climb_m));
  parameters.radius_m = radius;
  parameters.passes = passes;
  parameters.epsilon_m = static_cast<Real>(view.parameters().epsilon_m);
  proxy.configure(parameters);
}

Real ProxyBench::distance_m(const GripPose& pose) const {
  Real smallest = std::numeric_limits<Real>::max();
  for (std::uint32_t i = 0; i < views_.size(); ++i) {
    const PairView& pair = views_[i];
    const BodyRecord& body =
        scene.view.bodies()[scene.view.pieces()[scene.view.pair_record(i).piece_b].body];
    const Vec3 y_w = pose.x0_w - Vec3(static_cast<Real>(body.reference_m[0]),
                                      static_cast<Real>(body.reference_m[1]),
                                      static_cast<Real>(body.reference_m[2]));
    Real best = -std::numeric_limits<Real>::max();
    const auto consider = [&](const Vec3& n) {
      best = std::max(best, gap_along(pair, pose, y_w, n));
    };
    for (std::uint32_t f = 0; f < pair.a.face_count; ++f) {
      consider(-(pose.r_wa * pair.a.face_normal(f)));
    }
    for (std::uint32_t f = 0; f < pair.b.face_count; ++f) consider(pair.b.face_normal(f));
    for (std::uint32_t e = 0; e < pair.a.edge_count; ++e) {
      const Vec3 u = pose.r_wa * ConstVec3Map(pair.a.edge_directions[e].unit);
      for (std::uint32_t g = 0; g < pair.b.edge_count; ++g) {
        const Vec3 n = u.cross(ConstVec3Map(pair.b.edge_directions[g].unit));
        const Real sine = std::sqrt(n.squaredNorm());
        if (sine < 1.0e-6_r) continue;
        consider(n / sine);
        consider(-n / sine);
      }
    }
    smallest = std::min(smallest, best);
  }
  return smallest;
}

}  // namespace haptic::test
