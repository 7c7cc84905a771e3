// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/verification/verified_pair.hpp"

#include <algorithm>

namespace haptic::sim {
namespace {

constexpr double kStiffness_n_per_m = 1000.0;
/// Pieces with at most this many vertices are searched in long double throughout.
constexpr std::size_t kWholeSearchVertices = 32;

Solid needle() { return centred_box("needle", 0.05, 0.0015, 0.0015); }
Solid plate() { return centred_box("plate", 0.05, 0.05, 0.001); }

}  // namespace

VerifiedBodies class_pair(std::size_t number) {
  const auto hulls = [](std::uint32_t count, double queries, double judged, double near) {
    const Vector axes(0.05, 0.04, 0.03);
    const std::string name = "hull " + std::to_string(count);
    return VerifiedBodies{name + ", " + name,
                          ellipsoid_hull(count, axes, 10 * count + 1),
                          ellipsoid_hull(count, axes, 10 * count + 2),
                          queries,
                          judged,
                          near};
  };
  switch (number) {
    case 0:
      return {"tetrahedron, box", paper_tetrahedron(), paper_box(), 0.20, 0.25, 0.30};
    case 1:
      return {"box, box", centred_box("box", 0.03, 0.025, 0.02), paper_box(), 0.18, 0.24, 0.30};
    case 2:
      return {"12-prism, box", prism_solid(12, 0.03, 0.06), paper_box(), 0.14, 0.14, 0.22};
    case 3:
      return hulls(32, 0.10, 0.04, 0.12);
    case 4:
      return hulls(64, 0.06, 0.025, 0.05);
    default:
      return hulls(200, 0.02, 0.005, 0.01);
  }
}

std::vector<VerifiedBodies> class_pairs() {
  std::vector<VerifiedBodies> pairs;
  for (std::size_t number = 0; number < kClassCount; ++number) pairs.push_back(class_pair(number));
  return pairs;
}

std::vector<VerifiedBodies> sliver_pairs() {
  const Solid box = paper_box();
  std::vector<VerifiedBodies> pairs;
  const auto add = [&](const char* name, const Solid& a, const Solid& b) {
    pairs.push_back({name, a, b, 0.05, 0.05, 0});
  };
  add("needle, box", needle(), box);
  add("plate, box", plate(), box);
  add("needle, needle", needle(), needle());
  add("plate, plate", plate(), plate());
  add("needle, plate", needle(), plate());
  add("plate, needle", plate(), needle());
  return pairs;
}

VerifiedPair::VerifiedPair(const VerifiedBodies& bodies, double epsilon_m)
    : name_(bodies.name),
      session_(scene_of(bodies.a, {&bodies.b, 1}, kStiffness_n_per_m, epsilon_m), bodies.name),
      a_(oracle_piece_of(session_.view().pair(0).a)),
      b_(oracle_piece_of(session_.view().pair(0).b)),
      size_m_(std::max(diameter(a_.vertices), diameter(b_.vertices))),
      epsilon_m_(widen(epsilon_m)),
      certificates_(a_, b_),
      sifted_(a_, b_, size_m_) {}

OraclePose VerifiedPair::oracle_pose(const Pose& pose_wa) const {
  const Quat& q = pose_wa.q_wa;
  const double* grip = view().bodies()[0].reference_m;
  const double* reference = view().bodies()[1].reference_m;
  OraclePose pose;
  pose.r = rotation_of(widen(q.w()), widen(q.x()), widen(q.y()), widen(q.z()));
  const WideVec p{widen(pose_wa.p_wa[0]), widen(pose_wa.p_wa[1]), widen(pose_wa.p_wa[2])};
  pose.x = (p + pose.r * WideVec{widen(grip[0]), widen(grip[1]), widen(grip[2])}) -
           WideVec{widen(reference[0]), widen(reference[1]), widen(reference[2])};
  return pose;
}

PairTruth VerifiedPair::truth(const OraclePose& pose) {
  const Precision precision = precision_of_real();
  const bool small = std::max(a_.vertices.size(), b_.vertices.size()) <= kWholeSearchVertices;
  return small ? search_pair(a_, b_, pose, size_m_, precision) : sifted_.search(pose, precision);
}

std::vector<NodeValue> VerifiedPair::near_candidates(const OraclePose& pose, Wide d_m,
                                                     Wide margin_m, Wide least_sine) {
  return sifted_.near_candidates(pose, d_m, epsilon_m_, margin_m, least_sine);
}

}  // namespace haptic::sim
