// SPDX-License-Identifier: Apache-2.0
#include "rt_core/proxy/support_feature.hpp"

#include <cmath>

#include "rt_core/scene/graph_rule.hpp"

namespace haptic {
namespace {

bool within(const PieceShadow& shadow, std::uint32_t f, Real height_m) noexcept {
  for (const std::uint16_t v : shadow.piece->face_vertices(f)) {
    if (!(shadow.drop_m(v) <= height_m)) return false;
  }
  return true;
}

SupportFeature feature(const PieceShadow& shadow, FeatureKind kind, std::uint32_t index) noexcept {
  return {kind, index, shadow.at, shadow.height_m, {}};
}

}  // namespace

SupportFeature level_face(const PieceShadow& shadow, std::uint32_t f) noexcept {
  return feature(shadow, FeatureKind::kFace, f);
}

SupportFeature support_feature(const PieceShadow& shadow, std::uint32_t v, Real height_m) noexcept {
  const PieceView& piece = *shadow.piece;
  SupportFeature best = feature(shadow, FeatureKind::kVertex, v);
  Real cosine = kMinFaceCosine;
  for_each_face_at(piece, v, [&](std::uint32_t f) {
    const Vec3 normal = piece.face_normal(f);
    const Real c = normal.dot(shadow.outward);
    if (!(c > cosine) || !within(shadow, f, height_m)) return;
    cosine = c;
    best.kind = FeatureKind::kFace;
    best.index = f;
    // The face falls where its normal leans to; the height counts along n, not outward.
    const Real per_cosine = -shadow.sense / c;
    best.slope = {per_cosine * normal.dot(shadow.e1), per_cosine * normal.dot(shadow.e2)};
  });
  if (best.kind == FeatureKind::kFace) return best;

  Real flattest = kMaxEdgeSlope;
  for (const std::uint16_t e : piece.edges_at(v)) {
    const Vec3 u = ConstVec3Map(piece.edge_directions[e].unit);
    const Real rise = u.dot(shadow.outward);
    if (!(std::abs(rise) < flattest) || !(shadow.drop_m(piece.other_end(e, v)) <= height_m)) {
      continue;
    }
    flattest = std::abs(rise);
    best.kind = FeatureKind::kEdge;
    best.index = e;
    const PlanePoint way{shadow.e1.dot(u), shadow.e2.dot(u)};
    const Real per_way = shadow.sense * rise / dot(way, way);  // at least 1 - kMaxEdgeSlope^2
    best.slope = {per_way * way.x, per_way * way.y};
  }
  return best;
}

}  // namespace haptic
