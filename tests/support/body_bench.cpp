// SPDX-License-Identifier: Apache-2.0
#include "tests/support/body_bench.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "rt_core/base/rotation.hpp"

namespace haptic::test {
namespace {

/// Stiffness of rotation like that of a length of half the radius.
constexpr double kLengthShare = 0.5;

double radius_of(const tools::Body& body) {
  double radius = 0;
  for (const tools::ConvexPiece& piece : body.pieces) {
    for (const auto& v : piece.vertices) radius = std::max(radius, std::hypot(v[0], v[1], v[2]));
  }
  return radius;
}

/// Largest gap along a direction of a face or of two edges: the signed distance where the pieces
/// overlap, and a lower bound of it else.
double separation_m(const PairView& pair, const GripPose& pose, const Vec3& reference_w) {
  const Mat3& r = pose.r_wa;
  const Vec3 y = pose.x0_w - reference_w;
  std::vector<Vec3> a, b;
  for (std::uint32_t v = 0; v < pair.a.vertex_count; ++v) a.push_back(r * pair.a.vertex(v) + y);
  for (std::uint32_t v = 0; v < pair.b.vertex_count; ++v) b.push_back(pair.b.vertex(v));
  double best = -std::numeric_limits<double>::max();
  const auto along = [&](const Vec3& n) {
    const Real length = n.norm();
    if (!(length > 1e-12_r)) return;
    Real low_a = std::numeric_limits<Real>::max(), high_a = -low_a, low_b = low_a, high_b = -low_a;
    for (const Vec3& v : a) low_a = std::min(low_a, n.dot(v)), high_a = std::max(high_a, n.dot(v));
    for (const Vec3& v : b) low_b = std::min(low_b, n.dot(v)), high_b = std::max(high_b, n.dot(v));
    best = std::max(best, static_cast<double>(std::max(low_a - high_b, low_b - high_a) / length));
  };
  const auto normals = [&](const PieceView& piece, const std::vector<Vec3>& v) {
    for (std::uint32_t f = 0; f < piece.face_count; ++f) {
      const auto loop = piece.face_vertices(f);
      along((v[loop[1]] - v[loop[0]]).cross(v[loop[2]] - v[loop[0]]));
    }
  };
  normals(pair.a, a);
  normals(pair.b, b);
  for (std::uint32_t i = 0; i < pair.a.edge_count; ++i) {
    const auto& ea = pair.a.edges[i];
    const Vec3 da = a[ea.vertex[1]] - a[ea.vertex[0]];
    for (std::uint32_t j = 0; j < pair.b.edge_count; ++j) {
      const auto& eb = pair.b.edges[j];
      along(da.cross(b[eb.vertex[1]] - b[eb.vertex[0]]));
    }
  }
  return best;
}

GripPose on_way(const GripPose& from, const GripPose& to, Real share) {
  if (share == 1) return to;
  GripPose pose;
  pose.x0_w = from.x0_w + share * (to.x0_w - from.x0_w);
  const Vec3 turn = so3_log((to.q_wa * from.q_wa.conjugate()).normalized());
  pose.q_wa = (so3_exp(share * turn) * from.q_wa).normalized();
  pose.r_wa = pose.q_wa.toRotationMatrix();
  return pose;
}

}  // namespace

GripPose as_seen_from(const GripPose& b, const GripPose& a) {
  return seen_from(b, Vec3::Zero(), a);
}

BodyBench::BodyBench(const std::vector<BenchBody>& bodies, const std::vector<tools::Body>& standing,
                     double friction, std::uint32_t passes) {
  double least_radius_m = std::numeric_limits<double>::max(), extent_m = 0.1;
  for (std::uint32_t i = 0; i < bodies.size(); ++i) {
    const BenchBody& body = bodies[i];
    MovingBody& moving = moving_.emplace_back();
    const double radius_m = radius_of(body.body);
    moving.radius_m = static_cast<Real>(radius_m);
    moving.is_held_back = body.is_held_back;
    moving.spring.k_t_n_per_m = static_cast<Real>(body.k_n_per_m);
    moving.spring.length_m = static_cast<Real>(kLengthShare * radius_m);
    moving.spring.k_r_nm_per_rad =
        moving.spring.k_t_n_per_m * moving.spring.length_m * moving.spring.length_m;
    if (body.push_n > 0) {
      moving.spring.soft_translation_m = static_cast<Real>(body.push_n / body.k_n_per_m);
      moving.spring.soft_rotation_rad = moving.spring.soft_translation_m / moving.spring.length_m;
    }
    if (body.is_held_back) least_radius_m = std::min(least_radius_m, radius_m);
    extent_m = std::max(extent_m, radius_m);
    if (!standing.empty()) {
      scenes_.emplace_back(proxy_scene_of(body.body, {join(standing)}, friction));
      pairs_.push_back({i, kStanding, &scenes_.back().view});
    }
    for (std::uint32_t j = 0; j < i; ++j) {
      const bool is_smaller = radius_m < radius_of(bodies[j].body);
      const std::uint32_t a = is_smaller ? i : j, b = is_smaller ? j : i;
      scenes_.emplace_back(proxy_scene_of(bodies[a].body, {bodies[b].body}, friction));
      pairs_.push_back({a, b, &scenes_.back().view});
    }
  }
  const auto count = static_cast<std::uint32_t>(bodies.size());
  Arena counting;
  BodyLaw unplaced;
  unplaced.place(counting, pairs_, count, count);
  memory_.resize(counting.used() / sizeof(Line) + 1);
  Arena arena(memory_.front().bytes.data());
  law.place(arena, pairs_, count, count);
  law.read_scenes(pairs_);
  parameters.scale = proxy_scale(static_cast<Real>(least_radius_m), static_cast<Real>(extent_m), 0);
  parameters.passes = passes;
  parameters.epsilon_m = 1e-4_r;
  law.configure(parameters, pairs_, moving_);
  std::vector<GripPose> starts;
  for (const BenchBody& body : bodies) starts.push_back(body.start);
  law.begin(starts);
}

std::vector<GripPose> BodyBench::poses() const {
  std::vector<GripPose> all;
  for (std::uint32_t i = 0; i < law.body_count(); ++i) all.push_back(law.pose(i));
  return all;
}

double BodyBench::way_distance_m(std::span<const GripPose> from, std::span<const GripPose> to,
                                 Real share) const {
  double least = std::numeric_limits<double>::max();
  for (const BodyPairScene& pair : pairs_) {
    const auto seen = [&](std::span<const GripPose> poses) {
      return pair.b == kStanding ? poses[pair.a] : as_seen_from(poses[pair.b], poses[pair.a]);
    };
    const GripPose at = on_way(seen(from), seen(to), share);
    for (PairIndex k = 0; k < pair.scene->pair_count(); ++k) {
      const PairView view = pair.scene->pair(k);
      const BodyRecord& body = pair.scene->bodies()[view.b.record->body];
      Vec3 reference;
      for (int c = 0; c < 3; ++c) reference[c] = static_cast<Real>(body.reference_m[c]);
      least = std::min(least, separation_m(view, at, reference));
    }
  }
  return least;
}

}  // namespace haptic::test
