// SPDX-License-Identifier: Apache-2.0
#include "host_sim/oracle/plan_clearance.hpp"

#include <algorithm>
#include <limits>
#include <vector>

#include "host_sim/oracle/mesh_pair.hpp"
#include "tools/plan/search/pose_algebra.hpp"

namespace haptic::sim {
namespace {

/// Poses that are looked at: so many triangles of the part in all, within these bounds.
constexpr std::size_t kTrianglesLookedAt = 100'000, kLeastPoses = 100, kMostPoses = 2'000;

/// The faces of the pieces as fans. Those between two pieces lie inside the solid, farther from all
/// others than its surface.
std::vector<Triangle> triangles_of(const SceneView& scene, std::uint32_t begin, std::uint32_t end,
                                   bool fixed) {
  std::vector<Triangle> triangles;
  for (std::uint32_t k = begin; k < end; ++k) {
    const PieceView piece = scene.piece(k);
    const double* const reference = scene.bodies()[piece.record->body].reference_m;
    const auto corner = [&](std::uint32_t v) {
      const Real* const x = piece.vertices + 3 * std::size_t{v};
      WideVec at{widen(x[0]), widen(x[1]), widen(x[2])};
      if (fixed) at = at + WideVec{widen(reference[0]), widen(reference[1]), widen(reference[2])};
      return at;
    };
    // Of a facet both sides are faces; one is the facet.
    const std::uint32_t faces = is_flat(*piece.record) ? 1 : piece.face_count;
    for (std::uint32_t f = 0; f < faces; ++f) {
      const auto loop = piece.face_vertices(f);
      for (std::size_t v = 1; v + 1 < loop.size(); ++v)
        triangles.push_back({corner(loop[0]), corner(loop[v]), corner(loop[v + 1])});
    }
  }
  return triangles;
}

OraclePose oracle_pose(const tools::PlanPose& pose) {
  const auto& q = pose.q_wxyz;
  return {rotation_of(widen(q[0]), widen(q[1]), widen(q[2]), widen(q[3])),
          {widen(pose.x0_m[0]), widen(pose.x0_m[1]), widen(pose.x0_m[2])}};
}

}  // namespace

PlanClearance clearance_of(const SceneView& scene, const tools::Plan& plan) {
  const std::uint32_t moving = scene.bodies()[0].piece_count;
  const std::vector<Triangle> part = triangles_of(scene, 0, moving, false);
  const MeshPair pair(
      part, triangles_of(scene, moving, static_cast<std::uint32_t>(scene.pieces().size()), true));

  PlanClearance found;
  Wide least = std::numeric_limits<Wide>::infinity();
  const auto look = [&](const tools::PlanPose& pose) {
    found.poses += 1;
    const Wide distance = pair.distance_m(oracle_pose(pose), least);
    if (!(distance < least)) return;
    least = distance;
    found.at = pose;
  };

  double way_m = 0;
  for (std::size_t k = 0; k < plan.steps(); ++k)
    way_m += tools::step_length_m(plan.poses[k], plan.poses[k + 1], plan.length_m);
  const std::size_t most = std::clamp(kTrianglesLookedAt / std::max<std::size_t>(part.size(), 1),
                                      kLeastPoses, kMostPoses);
  const double stride_m = way_m / static_cast<double>(most);
  look(plan.poses.front());
  double gone_m = 0;  // since the last pose that was looked at
  for (std::size_t k = 0; k < plan.steps(); ++k) {
    const tools::PlanPose &from = plan.poses[k], &to = plan.poses[k + 1];
    const double step_m = tools::step_length_m(from, to, plan.length_m);
    double at_m = 0;
    while (at_m + stride_m - gone_m < step_m) {
      at_m += stride_m - gone_m;
      gone_m = 0;
      found.apart_m = std::max(found.apart_m, stride_m);
      look(tools::between(from, to, at_m / step_m));
    }
    gone_m += step_m - at_m;
    const bool last = k + 1 == plan.steps();
    if (!last && plan.steps() > most) continue;
    found.apart_m = std::max(found.apart_m, gone_m);
    gone_m = 0;
    look(to);
  }
  found.least_m = static_cast<double>(least);
  return found;
}

}  // namespace haptic::sim
