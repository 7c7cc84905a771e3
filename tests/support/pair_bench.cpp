// SPDX-License-Identifier: Apache-2.0
#include "tests/support/pair_bench.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace haptic::test {
namespace {

tools::SceneDescription description_of(const tools::Body& a, const tools::Body& b,
                                       double epsilon_m) {
  tools::SceneDescription description = scene_of(a, {b});
  description.parameters.epsilon_m = epsilon_m;
  return description;
}

}  // namespace

PairBench::PairBench(const tools::Body& a, const tools::Body& b, double epsilon_m)
    : PairBench(description_of(a, b, epsilon_m)) {}

PairBench::PairBench(const tools::SceneDescription& description)
    : scene_(description),
      pair_(scene_.view.pair(0)),
      tables_(pair_),
      epsilon_m_(static_cast<Real>(description.parameters.epsilon_m)) {}

const PairPose& PairBench::at(const Point& x, const std::array<double, 4>& q) {
  const Mat3 r = Quat(static_cast<Real>(q[0]), static_cast<Real>(q[1]), static_cast<Real>(q[2]),
                      static_cast<Real>(q[3]))
                     .normalized()
                     .toRotationMatrix();
  turn_vertices(pair_.a, r, tables_.lanes.data());
  const double* reference = scene_.view.bodies()[1].reference_m;
  const Vec3 y(static_cast<Real>(x[0] - reference[0]), static_cast<Real>(x[1] - reference[1]),
               static_cast<Real>(x[2] - reference[2]));
  pose_ = make_pair_pose(pair_, tables_.lanes.data(), r, y);
  if (moved_) {
    const double step = static_cast<double>((y - last_y_).norm());
    const double chord = static_cast<double>((r - last_r_).norm());  // not below the spectral norm
    const double margin = 1e-6 * (step + chord) + 1e-12;
    odometer_.of_b += step + chord * pair_.a.record->reach_m + margin;
    odometer_.of_a +=
        step + margin +
        chord * (static_cast<double>(last_y_.norm()) + step + pair_.b.record->reach_m);
  }
  last_y_ = y;
  last_r_ = r;
  moved_ = true;
  return pose_;
}

NearResult PairBench::search(NodeScope scope) {
  tables_.bounds.advance(odometer_, pose_.size_m);
  tables_.near.clear();
  return find_near_set(pose_, epsilon_m_, tables_.bounds, tables_.scratch, tables_.near, scope);
}

void PairBench::reset() { tables_.bounds.reset(pair_.marks); }

Real PairBench::exhaustive_d_near(NodeScope scope) const {
  Real best = -std::numeric_limits<Real>::max();
  for (std::uint32_t node = 0; node < pair_.record.node_count; ++node) {
    if (!pair_.marks.node(scope, node)) continue;
    const NodeFeatures n = node_features(pair_, node);
    const NodePlane plane = node_plane(pose_, n.type, n.i, n.j);
    if (!plane.defined) continue;
    const Real violation = node_violation(pose_, n.type, n.i, n.j, plane);
    if (violation > applicability_tolerance(pose_.size_m)) continue;
    best = std::max(best, node_value(pose_, n.type, n.i, n.j, plane, violation));
  }
  return best;
}

std::vector<std::uint32_t> PairBench::exhaustive_near(Real d_near_m, Real margin_m,
                                                      std::vector<std::uint32_t>& doubtful) const {
  std::vector<std::uint32_t> near;
  doubtful.clear();
  for (std::uint32_t node = 0; node < pair_.record.node_count; ++node) {
    if (!pair_.marks.node(NodeScope::kLive, node)) continue;
    const NodeFeatures n = node_features(pair_, node);
    const NodePlane plane = node_plane(pose_, n.type, n.i, n.j);
    if (!plane.defined) continue;
    const Real violation = node_violation(pose_, n.type, n.i, n.j, plane);
    const Real measure = std::abs(plane.f_m - d_near_m) + std::max(violation, Real{0});
    const Real margin = margin_m + 16 * kRealEpsilon * pose_.size_m / plane.sine;
    if (measure < epsilon_m_) near.push_back(node);
    if (std::abs(measure - epsilon_m_) < margin || plane.sine < 4 * kMinEdgeSine) {
      doubtful.push_back(node);
    }
  }
  return near;
}

}  // namespace haptic::test
