// SPDX-License-Identifier: Apache-2.0
#include "tools/plan/search/inside_surface.hpp"

#include <numbers>
#include <vector>

namespace haptic::tools {
namespace {

/// Turns differ from a whole number by less where the surface is closed.
constexpr double kWhole = HAPTIC_REAL_IS_FLOAT ? 1.0e-3 : 1.0e-6;
/// So many pieces of a body are asked for one of their vertices.
constexpr std::uint32_t kMostProbes = 32;

/// The solid angle of a triangle from the origin, by its sign of which side is seen.
double solid_angle(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  const double la = a.norm(), lb = b.norm(), lc = c.norm();
  return 2 * std::atan2(a.dot(b.cross(c)),
                        la * lb * lc + a.dot(b) * lc + a.dot(c) * lb + b.dot(c) * la);
}

/// How often the facets of a body run round a point of its frame: their side of the file is face 0.
double turns_round(const SceneView& scene, const BodyRecord& body, const Vec3d& x) {
  double sum = 0;
  for (std::uint32_t k = body.piece_begin; k < body.piece_begin + body.piece_count; ++k) {
    const PieceView piece = scene.piece(k);
    if (!is_flat(*piece.record)) continue;
    const auto loop = piece.face_vertices(0);
    const auto seen = [&](std::size_t corner) {
      return Vec3d(piece.vertex(loop[corner]).cast<double>() - x);
    };
    for (std::size_t corner = 2; corner < loop.size(); ++corner)
      sum += solid_angle(seen(0), seen(corner - 1), seen(corner));
  }
  return sum / (4 * std::numbers::pi);
}

/// A vertex each of pieces of a body, in its frame.
std::vector<Vec3d> probes_of(const SceneView& scene, const BodyRecord& body) {
  std::vector<Vec3d> probes;
  const std::uint32_t every = (body.piece_count + kMostProbes - 1) / kMostProbes;
  for (std::uint32_t k = 0; k < body.piece_count; k += every)
    probes.push_back(scene.piece(body.piece_begin + k).vertex(0).cast<double>());
  return probes;
}

bool lies_in(const SceneView& scene, const BodyRecord& body, const Vec3d& x) {
  const double turns = turns_round(scene, body, x);
  return std::abs(turns) > 0.5 && std::abs(turns - std::round(turns)) < kWhole;
}

}  // namespace

std::optional<std::uint32_t> enclosing_body(const SceneView& scene, const PlanPose& pose) {
  const auto bodies = scene.bodies();
  const Quatd q = turn_of(pose);
  const std::vector<Vec3d> of_part = probes_of(scene, bodies[0]);
  for (std::uint32_t b = 1; b < bodies.size(); ++b) {
    const Vec3d reference(bodies[b].reference_m);
    for (const Vec3d& x : of_part) {
      if (lies_in(scene, bodies[b], place_of(pose) + q * x - reference)) return b;
    }
    for (const Vec3d& x : probes_of(scene, bodies[b])) {
      if (lies_in(scene, bodies[0], q.conjugate() * (reference + x - place_of(pose)))) return b;
    }
  }
  return std::nullopt;
}

}  // namespace haptic::tools
