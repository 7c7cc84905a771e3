// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <vector>

#include "rt_core/contact/basic_contact.hpp"
#include "rt_core/contact/pair_verdict.hpp"
#include "tests/support/shapes.hpp"

using namespace haptic;
using namespace haptic::test;

namespace {

/// One pair at any pose, with the memory of the turned features.
class PairBench {
 public:
  PairBench(const tools::Body& a, const tools::Body& b)
      : scene_(scene_of(a, {b})),
        pair_(scene_.view.pair(0)),
        vertices_(3 * pair_.a.vertex_count),
        normals_(3 * pair_.a.face_count),
        directions_(3 * pair_.a.edge_count),
        moving_{vertices_.data(), normals_.data(), directions_.data()} {}

  PairPose at(const Point& x, const std::array<double, 4>& q) {
    const Mat3 r = Quat(static_cast<Real>(q[0]), static_cast<Real>(q[1]), static_cast<Real>(q[2]),
                        static_cast<Real>(q[3]))
                       .normalized()
                       .toRotationMatrix();
    turn_piece(pair_.a, r, moving_);
    const double* reference = scene_.view.bodies()[1].reference_m;
    const Vec3 y(static_cast<Real>(x[0] - reference[0]), static_cast<Real>(x[1] - reference[1]),
                 static_cast<Real>(x[2] - reference[2]));
    return make_pair_pose(pair_, moving_, r, y);
  }

  /// Largest value over all applicable nodes.
  static Real exhaustive(const PairPose& pose) {
    Real best = -std::numeric_limits<Real>::max();
    for (std::uint32_t node = 0; node < pose.pair->record->node_count; ++node) {
      const ContactType type = contact_type(*pose.pair->record, node);
      const NodeRecord& n = pose.pair->nodes[node];
      const NodePlane plane = node_plane(pose, type, n.a, n.b);
      if (!plane.defined) continue;
      const Real violation = node_violation(pose, type, n.a, n.b, plane);
      if (violation > applicability_tolerance(pose.size_m)) continue;
      best = std::max(best, node_value(pose, type, n.a, n.b, plane, violation));
    }
    return best;
  }

 private:
  LoadedScene scene_;
  PairView pair_;
  std::vector<Real> vertices_, normals_, directions_;
  MovingGeometry moving_;
};

}  // namespace

TEST_SUITE("rt_core.pair_verdict") {
  TEST_CASE("agrees with the exhaustive search, warm and cold, aligned and generic") {
    const tools::Body bodies[] = {
        box({-0.05, -0.04, -0.03}, {0.05, 0.04, 0.03}), prism(12, 0.04, 0.08),
        tetrahedron({0.05, 0, -0.03}, {-0.03, 0.04, -0.03}, {-0.03, -0.04, -0.03}, {0, 0, 0.06}),
        box({-0.05, -0.0015, -0.0015}, {0.05, 0.0015, 0.0015})};
    Random random(31);
    int separated = 0, colliding = 0, wrong = 0, undecided = 0;
    std::uint32_t most = 0;
    for (std::size_t pair = 0; pair < 8; ++pair) {
      PairBench bench(bodies[pair % 4],
                      bodies[pair < 4 ? 0 : 3]);  // against the box, then the needle
      VerdictMemory memory;
      for (int k = 0; k < 6000; ++k) {
        const bool aligned = k % 3 == 0;
        std::array<double, 4> q = aligned ? std::array<double, 4>{1, 0, 0, 0} : random.rotation();
        if (k % 6 == 3) q = {1, random.uniform(-1e-9, 1e-9), random.uniform(-1e-14, 1e-14), 0};
        const Point x = {random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1),
                         random.uniform(-0.1, 0.1)};
        const PairPose pose = bench.at(x, q);
        const Real d = PairBench::exhaustive(pose);
        if (k % 4 == 0) memory = VerdictMemory{};
        const VerdictResult verdict = pair_verdict(pose, memory);
        most = std::max(most, verdict.support_pairs);
        const Real rounding = 1000 * kRealEpsilon * pose.size_m;
        if (verdict.verdict == Verdict::kUndecided) ++undecided;
        if (verdict.verdict == Verdict::kSeparated) {
          ++separated;
          CHECK(verdict.separation_bound_m > 0);
          if (d < -rounding) ++wrong;
        } else if (verdict.verdict == Verdict::kColliding) {
          ++colliding;
          if (d > rounding) ++wrong;
        }
      }
    }
    CHECK(wrong == 0);
    CHECK(undecided == 0);
    CHECK(separated > 3000);
    CHECK(colliding > 3000);
    CHECK(most <= kMaxSupportPairsPerPair);
    MESSAGE("separated " << separated << ", colliding " << colliding << ", most support pairs "
                         << most);
  }

  TEST_CASE("the interior point itself and touching bodies collide") {
    PairBench bench(box({-0.05, -0.05, -0.05}, {0.05, 0.05, 0.05}),
                    box({-0.05, -0.05, -0.05}, {0.05, 0.05, 0.05}));
    VerdictMemory memory;
    CHECK(pair_verdict(bench.at({0, 0, 0}, {1, 0, 0, 0}), memory).verdict == Verdict::kColliding);
    memory = VerdictMemory{};
    CHECK(pair_verdict(bench.at({0.1, 0, 0}, {1, 0, 0, 0}), memory).verdict != Verdict::kSeparated);
    memory = VerdictMemory{};
    const VerdictResult apart = pair_verdict(bench.at({0.1001, 0, 0}, {1, 0, 0, 0}), memory);
    CHECK(apart.verdict == Verdict::kSeparated);
    CHECK(apart.separation_bound_m <= 0.0001_r * 1.01_r);
  }
}
