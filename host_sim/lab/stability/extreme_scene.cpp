// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/stability/extreme_scene.hpp"

#include <algorithm>
#include <cmath>

#include "host_sim/oracle/scene_oracle.hpp"
#include "host_sim/session/core_session.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {

namespace {

std::vector<double> powers(int low, int high, int step) {
  std::vector<double> list;
  for (int k = low; k <= high; k += step) list.push_back(std::pow(10.0, k));
  return list;
}

ExtremeScene sized_pair(double size_m) {
  ExtremeScene scene;
  scene.family = "size";
  scene.parameter = scene.size_m = size_m;
  scene.unit = "m";
  scene.a = scaled(paper_tetrahedron(), 10 * size_m);  // drawn at 0.1 m
  scene.b = scaled(paper_box(), 10 * size_m);
  return scene;
}

/// Small turns about one axis, which leave faces and edges the angle away from parallel.
ExtremeScene nearly_parallel(const char* family, double angle_rad, const Vector& axis) {
  ExtremeScene scene;
  scene.family = family;
  scene.parameter = angle_rad;
  scene.unit = "rad";
  scene.a = centred_box("cube", 0.03, 0.03, 0.03);
  scene.b = centred_box("block", 0.05, 0.04, 0.03);
  scene.rotation = [angle_rad, axis](Seeded& random) {
    // One of the quarter turns first: a different pair of faces each time.
    const Vector about = Vector::Unit(static_cast<int>(random.below(3)));
    const double turn = static_cast<double>(random.below(4)) * 0.5 * std::acos(-1.0);
    const Vector half = std::sin(0.5 * angle_rad) * axis.normalized();
    const Rotation small(std::cos(0.5 * angle_rad), half[0], half[1], half[2]);
    return Rotation(small * Rotation(Eigen::AngleAxisd(turn, about))).normalized();
  };
  return scene;
}

void add_slender(std::vector<ExtremeScene>& scenes, bool quick) {
  for (const double aspect : powers(1, 6, quick ? 5 : 1)) {
    ExtremeScene needle;
    needle.family = "needle";
    needle.parameter = aspect;
    needle.unit = "length / width";
    needle.a = centred_box("needle", 0.05 / aspect, 0.05 / aspect, 0.05);
    needle.b = centred_box("box", 0.05, 0.04, 0.03);
    scenes.push_back(needle);
    ExtremeScene plate = needle;
    plate.family = "plate";
    plate.unit = "width / thickness";
    plate.a = scaled(paper_tetrahedron(), 1);
    plate.b = centred_box("plate", 0.05, 0.05, 0.05 / aspect);
    scenes.push_back(plate);
  }
  ExtremeScene crossed;
  crossed.family = "needle_on_plate";
  crossed.parameter = 1e6;
  crossed.unit = "both aspects";
  crossed.a = centred_box("needle", 5e-8, 5e-8, 0.05);
  crossed.b = centred_box("plate", 0.05, 0.05, 5e-8);
  scenes.push_back(crossed);
}

void add_round(std::vector<ExtremeScene>& scenes, bool quick) {
  for (std::uint32_t sides = 8; sides <= 64; sides *= quick ? 8 : 2) {
    ExtremeScene scene;
    scene.family = "prisms";
    scene.parameter = sides;
    scene.unit = "vertices of a face";
    scene.a = prism_solid(sides, 0.04, 0.05);
    scene.b = prism_solid(sides, 0.05, 0.06);
    scenes.push_back(scene);
    // Face on face, one a seeded yaw against the other: all side edges nearly vertical.
    scene.family = "prisms_upright";
    scene.rotation = [](Seeded& random) {
      return Rotation(Eigen::AngleAxisd(random.uniform(-3.1, 3.1), Vector::UnitZ()));
    };
    scenes.push_back(scene);
  }
}

/// On the way to a pose: its depth needs to be near the one drawn, not at it.
constexpr int kHalvings = 24;

WideVec wide(const Vec3& v) { return {widen(v[0]), widen(v[1]), widen(v[2])}; }

/// The pair in long double with A at a pose of the core.
class WidePair {
 public:
  explicit WidePair(const SceneView& view)
      : a_(oracle_piece_of(view.piece(view.pair_record(0).piece_a))),
        b_(oracle_piece_of(view.piece(view.pair_record(0).piece_b))) {
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

Solid scaled(const Solid& solid, double factor) { return scaled(solid, Vector::Constant(factor)); }

Solid scaled(const Solid& solid, const Vector& factors) {
  Solid result = solid;
  for (Vector& v : result.vertices) v = v.cwiseProduct(factors);
  return result;
}

std::vector<ExtremeScene> extreme_scenes(bool quick) {
  std::vector<ExtremeScene> scenes;
  for (const double size_m : powers(-6, 3, quick ? 9 : 1)) scenes.push_back(sized_pair(size_m));
  for (const double offset_m : powers(0, 4, quick ? 4 : 1)) {
    ExtremeScene scene = sized_pair(0.1);
    scene.family = "offset";
    scene.parameter = offset_m;
    scene.place_w = Vector(1, -0.7, 0.6).normalized() * offset_m;
    scenes.push_back(scene);
  }
  add_slender(scenes, quick);
  for (const double angle_rad : powers(-16, -2, quick ? 7 : 1)) {
    scenes.push_back(nearly_parallel("parallel_faces", angle_rad, Vector(1, 0.3, 0)));
    scenes.push_back(nearly_parallel("parallel_edges", angle_rad, Vector(0, 0, 1)));
    scenes.push_back(nearly_parallel("parallel_all", angle_rad, Vector(1, -0.8, 0.6)));
  }
  add_round(scenes, quick);
  for (const double size_m : {1e-10, 1e8}) {
    scenes.push_back(sized_pair(size_m));
    scenes.back().family = "refused_size";
    scenes.back().refused = true;
  }
  ExtremeScene far = sized_pair(0.1);
  far.family = "refused_offset";
  far.parameter = 1e8;
  far.place_w = Vector(far.parameter, 0, 0);
  far.refused = true;
  scenes.push_back(far);
  return scenes;
}

std::vector<std::byte> compiled(const ExtremeScene& scene, LawId law) {
  tools::SceneDescription description;
  description.name = scene.a.name + " on " + scene.b.name;
  description.moving.body = united_body({&scene.a, 1});
  tools::PlacedBody obstacle;
  obstacle.body = united_body({&scene.b, 1});
  const Rotation& q = scene.turn_w;
  obstacle.quaternion_wxyz = {q.w(), q.x(), q.y(), q.z()};
  obstacle.position_m = {scene.place_w[0], scene.place_w[1], scene.place_w[2]};
  description.statics.push_back(obstacle);
  description.parameters.law = law;
  description.parameters.k_f_n_per_m = kExtremeStiffness_n_per_m;
  description.parameters.epsilon_m = 1e-3 * std::min(scene.size_m, 1e3);
  double radius_m = 0;
  for (const Vector& v : scene.a.vertices) radius_m = std::max(radius_m, v.norm());
  // Soft enough in rotation for a tilted face to come to lie flat.
  const double length_m = 0.75 * radius_m;
  description.parameters.coupling.k_r_nm_per_rad = kExtremeStiffness_n_per_m * length_m * length_m;
  description.parameters.exact_band_m = kMaxSceneLength_m;
  return tools::write_scene(description);
}

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
