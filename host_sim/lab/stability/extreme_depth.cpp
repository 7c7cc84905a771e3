// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/stability/extreme_depth.hpp"

#include <algorithm>
#include <cmath>

#include "host_sim/oracle/scene_oracle.hpp"
#include "host_sim/session/core_session.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

/// On the way to a pose: its depth needs to be near the one drawn, not at it.
constexpr int kHalvings = 24;

WideVec wide(const Vec3& v) { return {widen(v[0]), widen(v[1]), widen(v[2])}; }

/// The pair in long double with A at a pose of the core.
class WidePair {
 public:
  explicit WidePair(const SceneView& view)
      : a_(oracle_piece_of(view.piece(view.pairs()[0].piece_a))),
        b_(oracle_piece_of(view.piece(view.pairs()[0].piece_b))) {
    for (std::size_t i = 0; i < 2; ++i) {
      const double* p = view.bodies()[i].reference_m;
      reference_[i] = {widen(p[0]), widen(p[1]), widen(p[2])};
    }
  }

  [[nodiscard]] OraclePose pose(const Pose& pose_wa) const {
    const Quat& q = pose_wa.q_wa;
    OraclePose pose;
    pose.r = rotation_of(widen(q.w()), widen(q.x()), widen(q.y()), widen(q.z()));
    pose.x = (wide(pose_wa.p_wa) - reference_[1]) + pose.r * reference_[0];
    return pose;
  }

  /// min over A of n.a - max over B of n.b: a lower bound of the signed distance for any unit n.
  [[nodiscard]] Wide gap_along(const OraclePose& pose, const WideVec& n) const {
    return PlacedPair(a_, b_, pose).gap_along(n, b_.vertices.front());
  }

  /// Smallest angle from `n` to a C-face normal whose plane has D_near within `tie_m`; pi where
  /// there is none.
  [[nodiscard]] double angle_to_best(const OraclePose& pose, const WideVec& n, Wide d_near_m,
                                     Wide tie_m) const {
    Wide chord = 2;
    const PlacedPair placed(a_, b_, pose);
    const auto take = [&](const WideVec& normal, Wide depth_m) {
      if (depth_m >= d_near_m - tie_m) chord = std::min(chord, norm(normal - n));
    };
    for (std::size_t f = 0; f < a_.loops.size(); ++f)
      take(-1.0L * placed.na[f], placed.gap_of_face_a(f));
    for (std::size_t f = 0; f < b_.loops.size(); ++f) take(b_.normals[f], placed.gap_of_face_b(f));
    for (std::uint32_t e = 0; e < a_.edges.size(); ++e) {
      for (std::uint32_t g = 0; g < b_.edges.size(); ++g) {
        NodeValue node;
        if (!node_of_type_c(placed, e, g, node) || node.violation_m > tie_m) continue;
        take(node.normal, node.depth_m);
      }
    }
    return 2 * std::asin(std::min(1.0, static_cast<double>(chord / 2)));
  }

 private:
  OraclePiece a_, b_;
  WideVec reference_[2];
};

/// A pose with D_near close to `depth_m`: along a ray from B's middle, where the distance of convex
/// bodies rises.
Pose pose_at_depth(const ExtremeScene& scene, const SceneOracle& oracle, const Rotation& q,
                   const Vector& direction, double depth_m) {
  double low = 0, high = 4 * static_cast<double>(oracle.size_m());
  std::vector<PairVerdict> verdicts;
  Pose pose;
  for (int k = 0; k < kHalvings; ++k) {
    const double middle = 0.5 * (low + high);
    pose = pose_at(scene.place_w + middle * direction, q);
    oracle.evaluate(pose, verdicts);
    (static_cast<double>(verdicts[0].truth.reference_m) < depth_m ? low : high) = middle;
  }
  return pose;
}

}  // namespace

DepthErrors measure_depth(const ExtremeScene& scene, std::uint32_t poses, std::uint64_t seed,
                          double fault_m) {
  DepthErrors errors;
  std::vector<std::byte> blob;
  try {
    blob = compiled(scene, LawId::kPaper);
  } catch (const tools::InputError& refusal) {
    errors.refusal = refusal.what();
    return errors;
  }
  CoreSession session(blob, scene.family);
  const SceneOracle oracle(session.view());
  const WidePair pair(session.view());
  Seeded random(seed);
  std::vector<PairVerdict> verdicts;
  for (std::uint32_t k = 0; k < poses; ++k) {
    const Rotation q = scene.rotation ? scene.rotation(random) : random.rotation();
    const double share = (k % 4 == 0 ? 0.1 : 0.01) * random.uniform(-1, 1);
    StepInput input;
    input.report_goal_contact = true;
    input.sequence = k;
    input.pose_wa = pose_at_depth(scene, oracle, q, random.direction(),
                                  share * static_cast<double>(oracle.size_m()));
    const StepResult result = session.core().step(input);
    errors.poses += 1;
    if (result.status != RtStatus::kOk) {
      errors.refused_poses += 1;
      continue;
    }
    oracle.evaluate(input.pose_wa, verdicts);
    const PairVerdict& truth = verdicts[0];
    const double limit_m = static_cast<double>(truth.tolerance_m);
    errors.limit_m = std::max(errors.limit_m, limit_m);
    const PairReport report = session.core().pair_report(0);
    const Wide d_near_m = widen(report.d_near_m) + widen(fault_m);
    const int side = truth.side();
    if ((side > 0 && d_near_m <= 0) || (side < 0 && d_near_m > 0)) errors.wrong_verdicts += 1;
    const double depth_error_m = static_cast<double>(truth.error_m(d_near_m));
    errors.depth_error_m = std::max(errors.depth_error_m, depth_error_m);
    if (!(depth_error_m <= limit_m) || !report.exact) errors.wrong_depths += 1;
    if (report.d_near_m > 0) continue;  // outside, the normal reported is that of the certificate
    const OraclePose pose = pair.pose(input.pose_wa);
    const WideVec n = unit(wide(report.normal_w));
    const double shortfall_m =
        static_cast<double>(truth.truth.reference_m - pair.gap_along(pose, n));
    errors.normal_shortfall_m = std::max(errors.normal_shortfall_m, shortfall_m);
    if (!(shortfall_m <= limit_m)) errors.wrong_normals += 1;
    errors.normal_angle_rad =
        std::max(errors.normal_angle_rad,
                 pair.angle_to_best(pose, n, truth.truth.reference_m, truth.tolerance_m));
  }
  return errors;
}

}  // namespace haptic::sim
