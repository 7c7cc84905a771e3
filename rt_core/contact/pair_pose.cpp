// SPDX-License-Identifier: Apache-2.0
#include "rt_core/contact/pair_pose.hpp"

namespace haptic {
namespace {

void store(Real* out, const Vec3& v) noexcept {
  out[0] = v[0];
  out[1] = v[1];
  out[2] = v[2];
}

}  // namespace

void turn_piece(const PieceView& piece, const Mat3& r_wa, const MovingGeometry& out) noexcept {
  const PieceRecord& r = *piece.record;
  for (std::uint32_t v = 0; v < piece.vertex_count; ++v) {
    store(out.vertices_w + 3 * std::size_t{r.vertex_begin + v}, r_wa * piece.vertex(v));
  }
  for (std::uint32_t f = 0; f < piece.face_count; ++f) {
    store(out.normals_w + 3 * std::size_t{r.face_begin + f}, r_wa * piece.face_normal(f));
  }
  for (std::uint32_t e = 0; e < piece.edge_count; ++e) {
    store(out.directions_w + 3 * std::size_t{r.edge_begin + e},
          r_wa * ConstVec3Map(piece.edge_directions[e].unit));
  }
}

PairPose make_pair_pose(const PairView& pair, const MovingGeometry& moving, const Mat3& r_wa,
                        const Vec3& y_w) noexcept {
  const PieceRecord& a = *pair.a.record;
  const PieceRecord& b = *pair.b.record;
  PairPose pose;
  pose.pair = &pair;
  pose.vertices_w = moving.vertices_w + 3 * std::size_t{a.vertex_begin};
  pose.normals_w = moving.normals_w + 3 * std::size_t{a.face_begin};
  pose.directions_w = moving.directions_w + 3 * std::size_t{a.edge_begin};
  pose.y_w = y_w;
  const Vec3 mean_a(static_cast<Real>(a.centre_m[0]), static_cast<Real>(a.centre_m[1]),
                    static_cast<Real>(a.centre_m[2]));
  const Vec3 mean_b(static_cast<Real>(b.centre_m[0]), static_cast<Real>(b.centre_m[1]),
                    static_cast<Real>(b.centre_m[2]));
  pose.interior_w = mean_b - r_wa * mean_a;
  pose.size_m = static_cast<Real>(a.radius_m + b.radius_m);
  return pose;
}

}  // namespace haptic
