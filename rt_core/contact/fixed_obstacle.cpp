// SPDX-License-Identifier: Apache-2.0
#include "rt_core/contact/fixed_obstacle.hpp"

#include <algorithm>
#include <cmath>

namespace haptic {
namespace {

std::uint32_t number_of(const NodeNumbering& numbers, ContactType type, std::uint32_t i,
                        std::uint32_t j) noexcept {
  return type == ContactType::kA   ? numbers.type_a(i, j)
         : type == ContactType::kB ? numbers.type_b(i, j)
                                   : numbers.type_c(i, j);
}

/// Planes of one run: the largest gap in it; among ties the lowest number.
struct Run {
  std::uint32_t begin = 0, end = 0;
  std::uint32_t best = 0;
  Real gap_m = kNoDepth;
};

void scan(const PairView& pair, const Vec3& y_w, NodeScope scope, Run& run) noexcept {
  for (std::uint32_t k = run.begin; k < run.end; ++k) {
    const FixedPlane& plane = pair.planes[k];
    const Real gap = gap_at(plane, y_w);
    if (scope == NodeScope::kLive && !has_force(plane, PlaneForce::kBears)) continue;
    if (gap > run.gap_m) {
      run.gap_m = gap;
      run.best = k;
    }
  }
}

bool is_near(const FixedNode& at, Real f_m, Real d_near_m, Real epsilon_m) noexcept {
  return std::abs(f_m - d_near_m) + std::max(at.violation_m, Real{0}) < epsilon_m;
}

NearNode node_at(const NodeNumbering& numbers, const FixedPlane& plane, const FixedNode& at,
                 Real gap_m) noexcept {
  NearNode node;
  node.type = static_cast<ContactType>(at.type);
  node.i = at.i;
  node.j = at.j;
  node.node = number_of(numbers, node.type, at.i, at.j);
  node.normal_w = ConstVec3Map(plane.normal);
  node.f_m = gap_m + at.rise_m;
  node.violation_m = at.violation_m;
  node.rise_m = node.type == ContactType::kC ? 0 : at.rise_m;
  return node;
}

}  // namespace

NearResult find_fixed_near_set(const PairView& pair, const Vec3& y_w, Real size_m, Real epsilon_m,
                               BoundedList<NearNode>& near, NodeScope scope) noexcept {
  const FixedPairRecord& fixed = *pair.fixed;
  const NodeNumbering numbers = numbering(pair.a, pair.b);
  const std::uint32_t faces = pair.a.face_count + pair.b.face_count;
  Run a{0, pair.a.face_count}, b{pair.a.face_count, faces}, c{faces, fixed.bounding_count};
  NearResult result;
  for (Run* const run : {&a, &b, &c}) scan(pair, y_w, scope, *run);
  result.feature_evaluations = fixed.plane_count;
  const Real best_face = std::max(a.gap_m, b.gap_m);
  result.d_near_m = std::max(best_face, c.gap_m);
  const Real tie = height_rounding(*pair.a.record) + height_rounding(*pair.b.record);
  if (result.d_near_m == kNoDepth) return result;
  const Real tolerance = 64 * kRealEpsilon * size_m;  // as the search without planes has it
  const Run& best = c.gap_m > best_face + tolerance ? c : b.gap_m > a.gap_m + tolerance ? b : a;
  const FixedPlane& plane = pair.planes[best.best];
  result.best.type = static_cast<ContactType>(plane.type);
  result.best.i = plane.i;
  result.best.j = plane.j;
  result.best.node = number_of(numbers, result.best.type, plane.i, plane.j);
  result.best.normal_w = ConstVec3Map(plane.normal);
  result.best.f_m = best.gap_m;
  result.attained = result.d_near_m - best.gap_m <= tie;
  result.support.a = best.best;
  // A node with its value near D_near lies on a plane whose gap is less by its rise at most.
  const Real least = result.d_near_m - (kMaxRise + 1) * epsilon_m;
  for (std::uint32_t k = 0; k < fixed.plane_count; ++k) {
    const FixedPlane& other = pair.planes[k];
    if (other.node_count == 0) continue;
    const Real gap = gap_at(other, y_w);
    if (gap < least) continue;
    for (std::uint32_t l = 0; l < other.node_count; ++l) {
      const FixedNode& at = pair.plane_nodes[other.node_begin + l];
      if (!is_near(at, gap + at.rise_m, result.d_near_m, epsilon_m)) continue;
      if (!near.push(node_at(numbers, other, at, gap))) result.flags |= kNearSetCut;
    }
  }
  return result;
}

NearestPlane nearest_fixed_plane(const PairView& pair, const Vec3& y_w) noexcept {
  NearestPlane nearest;
  for (std::uint32_t k = 0; k < pair.fixed->bounding_count; ++k) {
    const Real gap = gap_at(pair.planes[k], y_w);
    if (gap > nearest.gap_m) nearest = {k, gap};
  }
  return nearest;
}

VerdictResult fixed_verdict(const NearResult& near, Real rounding_m) noexcept {
  VerdictResult result;
  result.normal_w = near.best.normal_w;
  if (near.d_near_m > rounding_m) {
    result.verdict = Verdict::kSeparated;
    result.separation_bound_m = std::min(near.d_near_m, near.best.f_m);
    return result;
  }
  const bool inside = near.d_near_m < -rounding_m;
  result.verdict = inside ? Verdict::kColliding : Verdict::kTouching;
  result.thickness_m = inside ? rounding_m : std::max(std::abs(near.d_near_m), rounding_m);
  return result;
}

PlaneGap fixed_plane_gap(const PairView& pair, const Vec3& y_w, const PlaneId& id) noexcept {
  const FixedPlane& plane = pair.planes[plane_number(id)];
  PlaneGap gap;
  gap.id = id;
  gap.normal_w = ConstVec3Map(plane.normal);
  gap.gap_m = gap_at(plane, y_w);
  gap.defined = true;
  return gap;
}

ValidResult find_valid_fixed_planes(const PairView& pair, const Vec3& y_w, Real least_gap_m,
                                    std::span<ValidPlane> planes) noexcept {
  ValidResult result;
  result.visited = pair.fixed->bounding_count;
  for (const bool hidden : {false, true}) {
    for (std::uint32_t k = 0; k < pair.fixed->bounding_count; ++k) {
      if (has_force(pair.planes[k], PlaneForce::kHidden) != hidden) continue;
      const Real gap = gap_at(pair.planes[k], y_w);
      if (gap < least_gap_m) continue;
      if (result.count == planes.size()) {
        result.cut = true;
        return result;
      }
      planes[result.count++] = {fixed_plane_id(k), {}, gap};
      if (!hidden) result.exposed = result.count;
    }
  }
  return result;
}

}  // namespace haptic
