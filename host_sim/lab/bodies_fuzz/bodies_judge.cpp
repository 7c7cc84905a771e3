// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/bodies_fuzz/bodies_judge.hpp"

#include <algorithm>
#include <cmath>

#include "host_sim/lab/bodies_fuzz/bodies_session.hpp"

namespace haptic::sim {
namespace {

/// At the end of a tick, pairs farther apart than this are not looked at.
constexpr Wide kFarBodies_m = 1e-3L;
constexpr Wide kNoGap = std::numeric_limits<Wide>::infinity();
/// Poses of two bodies and what is between them, each rounded to Real.
constexpr Wide kPoseRoundings = 32;

WideVec wide_vector(const Vector& v) { return {widen(v[0]), widen(v[1]), widen(v[2])}; }

WideVec into(const WideRotation& r, const WideVec& v) {
  return v.x * r.row[0] + v.y * r.row[1] + v.z * r.row[2];
}

OraclePose as_oracle(const WidePose& pose) { return {pose.r, pose.p}; }

JudgedBody judged(const std::vector<Solid>& pieces, std::vector<Triangle> triangles) {
  JudgedBody body;
  for (const Solid& piece : pieces) {
    std::vector<WideVec> vertices;
    for (const Vector& v : piece.vertices) vertices.push_back(wide_vector(v));
    body.pieces.push_back(make_oracle_piece(std::move(vertices), piece.loops));
  }
  for (const Triangle& t : triangles) {
    for (const WideVec& v : t) body.radius_m = std::max(body.radius_m, norm(v));
  }
  body.triangles = std::move(triangles);
  return body;
}

}  // namespace

WidePose seen_from_wide(const WidePose& b, const WidePose& a) {
  WidePose seen;
  seen.p = into(b.r, a.p - b.p);
  const Wide* p = b.q_wxyz;
  const Wide* q = a.q_wxyz;
  Wide* const c = seen.q_wxyz;
  // The conjugate of p times q.
  c[0] = p[0] * q[0] + p[1] * q[1] + p[2] * q[2] + p[3] * q[3];
  c[1] = p[0] * q[1] - p[1] * q[0] - p[2] * q[3] + p[3] * q[2];
  c[2] = p[0] * q[2] - p[2] * q[0] - p[3] * q[1] + p[1] * q[3];
  c[3] = p[0] * q[3] - p[3] * q[0] - p[1] * q[2] + p[2] * q[1];
  seen.r = rotation_of(c[0], c[1], c[2], c[3]);
  return seen;
}

WidePull wide_pull(const Spring& spring, const WideError& error) {
  WidePull pull;
  const auto along = [&](const WideVec& g, Wide k, Wide limit, WideVec& force) {
    const Wide x = norm(g);
    const bool soft = limit > 0 && x > limit;
    force = (soft ? k * limit / x : k) * g;
    pull.energy_j += soft ? k * limit * (x - limit / 2) : k * x * x / 2;
  };
  along(error.translation_m, widen(spring.k_t_n_per_m), widen(spring.soft_translation_m),
        pull.force);
  along(error.rotation_rad, widen(spring.k_r_nm_per_rad), widen(spring.soft_rotation_rad),
        pull.torque);
  return pull;
}

BodyPairJudge::BodyPairJudge(const JudgedBody& a, const JudgedBody& b, Wide tolerance_m,
                             Wide allowed_m)
    : radius_a_m_(a.radius_m),
      reach_m_(a.radius_m + b.radius_m),
      tolerance_m_(tolerance_m),
      allowed_m_(allowed_m) {
  if (a.pieces.empty() || b.pieces.empty()) {
    meshes_ = std::make_unique<MeshPair>(a.triangles, b.triangles);
    return;
  }
  for (const OraclePiece& of_a : a.pieces) {
    for (const OraclePiece& of_b : b.pieces) witnesses_.emplace_back(of_a, of_b);
  }
}

bool BodyPairJudge::far(const WidePose& pose, Wide distance_m) const {
  return norm(pose.p) - reach_m_ > distance_m;
}

Wide BodyPairJudge::end_gap_m(const WidePose& pose, Wide wanted_m) {
  if (far(pose, kFarBodies_m)) return kNoGap;
  const OraclePose at = as_oracle(pose);
  if (meshes_) return -meshes_->crossing(at).depth_m;
  Wide smallest = kNoGap;
  for (FreeWitness& witness : witnesses_) {
    if (witness.far(at, kFarBodies_m)) continue;
    Wide gap = witness.find(at, wanted_m).gap_m;
    if (!(gap >= wanted_m)) gap = std::max(gap, witness.exhaustive_m(at));
    smallest = std::min(smallest, gap);
  }
  return smallest;
}

Wide BodyPairJudge::way_gap_m(const WidePose& from, const WidePose& to) {
  const PairPath path(from, to, {});
  const Wide way = norm(path.move_m) + radius_a_m_ * norm(path.turn_rad);
  if (!(way > 0) || far(from, way + tolerance_m_)) return kNoGap;
  const Wide resolution = tolerance_m_ / 50;
  if (meshes_) {
    return meshes_->passage({as_oracle(from), path.move_m, path.turn_rad}, allowed_m_, resolution)
        .gap_m;
  }
  Wide smallest = kNoGap;
  for (FreeWitness& witness : witnesses_) {
    if (witness.far(as_oracle(from), way + tolerance_m_)) continue;
    smallest = std::min(smallest, witness.path_m(path, -allowed_m_, resolution));
  }
  return smallest;
}

Wide BodyPairJudge::clear_m(const WidePose& pose, Wide within_m) {
  if (far(pose, within_m)) return kNoGap;
  const OraclePose at = as_oracle(pose);
  if (meshes_) return meshes_->distance_m(at, within_m);
  Wide smallest = kNoGap;
  for (FreeWitness& witness : witnesses_) {
    if (witness.far(at, within_m)) continue;
    smallest = std::min(smallest, witness.find(at, within_m).gap_m);
  }
  return smallest;
}

BodiesJudge::BodiesJudge(const CompiledBodies& compiled) : compiled_(compiled) {
  const BodiesScene& scene = compiled.scene;
  for (const FuzzBody& body : scene.bodies) {
    bodies_.push_back(judged(body.pieces, body.triangles()));
    has_surfaces_ = has_surfaces_ || body.is_surface();
  }
  FuzzBody standing;
  standing.pieces = scene.standing;
  bodies_.push_back(judged(standing.pieces, standing.triangles()));
  extent_m_ = widen(scene.extent_m());
  tolerance_m_ = widen(bodies_scale(scene).tolerance_m);
  allowed_m_ = tolerance_m_ + kPoseRoundings * widen(std::numeric_limits<Real>::epsilon()) *
                                  (widen(scene.felt_radius_m()) + extent_m_);
  for (const CompiledBodyPair& pair : compiled.pairs) {
    std::size_t b = pair.b == kFuzzStanding ? scene.bodies.size() : pair.b;
    if (pair.standing) {
      b = bodies_.size();
      bodies_.push_back(judged(pair.standing->pieces, pair.standing->triangles()));
      has_surfaces_ = has_surfaces_ || pair.standing->is_surface();
    }
    pairs_.emplace_back(bodies_[pair.a], bodies_[b], tolerance_m_, allowed_m_);
  }
}

std::string BodiesJudge::name_of(std::size_t number) const {
  const CompiledBodyPair& pair = compiled_.pairs[number];
  const auto name = [&](std::size_t body) {
    if (body == kFuzzStanding) return std::string("what stands");
    const FuzzBody& of = compiled_.scene.bodies[body];
    return std::string(to_text(of.role)) + " " + of.name;
  };
  return name(pair.a) + " and " + name(pair.b);
}

WidePose BodiesJudge::relative(std::size_t number, std::span<const WidePose> poses) const {
  const CompiledBodyPair& pair = compiled_.pairs[number];
  return pair.b == kFuzzStanding ? poses[pair.a] : seen_from_wide(poses[pair.b], poses[pair.a]);
}

BodiesJudge::PairGap BodiesJudge::end_gap(std::span<const WidePose> poses, Wide wanted_m) {
  PairGap smallest;
  for (std::size_t k = 0; k < pairs_.size(); ++k) {
    const Wide gap = pairs_[k].end_gap_m(relative(k, poses), wanted_m);
    if (!(gap >= smallest.gap_m)) smallest = {gap, k};
  }
  return smallest;
}

BodiesJudge::PairGap BodiesJudge::way_gap(std::span<const WidePose> before,
                                          std::span<const WidePose> after) {
  PairGap smallest;
  for (std::size_t k = 0; k < pairs_.size(); ++k) {
    const Wide gap = pairs_[k].way_gap_m(relative(k, before), relative(k, after));
    if (!(gap >= smallest.gap_m)) smallest = {gap, k};
  }
  return smallest;
}

template <typename Wanted>
Wide BodiesJudge::clear_of(std::span<const WidePose> poses, Wide within_m, const Wanted& wanted) {
  Wide smallest = kNoGap;
  for (std::size_t k = 0; k < pairs_.size(); ++k) {
    if (!wanted(compiled_.pairs[k])) continue;
    smallest = std::min(smallest, pairs_[k].clear_m(relative(k, poses), within_m));
  }
  return smallest;
}

Wide BodiesJudge::clear_m(std::size_t body, std::span<const WidePose> poses, Wide within_m) {
  return clear_of(poses, within_m,
                  [&](const CompiledBodyPair& pair) { return pair.a == body || pair.b == body; });
}

Wide BodiesJudge::clear_of_earlier_m(std::size_t body, std::span<const WidePose> poses,
                                     Wide within_m) {
  return clear_of(poses, within_m, [&](const CompiledBodyPair& pair) {
    return pair.b == body || (pair.a == body && pair.b == kFuzzStanding);
  });
}

}  // namespace haptic::sim
