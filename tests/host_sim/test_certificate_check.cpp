// SPDX-License-Identifier: Apache-2.0
// The judges of the verification, on cases whose answer is known.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "host_sim/oracle/certificate_check.hpp"
#include "host_sim/oracle/exhaustive.hpp"
#include "host_sim/oracle/sifted_pair.hpp"
#include "tests/host_sim/sample_scenes.hpp"

using namespace haptic::sim;
using namespace haptic::sim::test;

namespace {

const Precision kDouble{0x1p-52L, 1.5e-8L, 1e-12L, 1e-12L};

/// Number of the corner of a piece at a point.
std::uint32_t corner(const OraclePiece& piece, const WideVec& at) {
  std::uint32_t best = 0;
  for (std::uint32_t v = 0; v < piece.vertices.size(); ++v) {
    if (norm(piece.vertices[v] - at) < norm(piece.vertices[best] - at)) best = v;
  }
  return best;
}

/// Random poses near the boundary; every second one aligned, with a tilt of 0 or 1e-16 to 1e-3 rad.
OraclePose draw_pose(Random& random, int number) {
  OraclePose pose;
  if (number % 2 == 0) {
    pose.r = rotation_of(random.wide() - 0.5L, random.wide() - 0.5L, random.wide() - 0.5L,
                         random.wide());
  } else {
    const Wide tilt = number % 4 == 1 ? 0 : std::pow(10.0L, -16 + 13 * random.wide());
    pose.r = rotation_of(1, tilt * random.wide(), tilt * random.wide(), tilt * random.wide());
  }
  pose.x = {0.3L * (random.wide() - 0.5L), 0.3L * (random.wide() - 0.5L),
            0.3L * (random.wide() - 0.5L)};
  return pose;
}

}  // namespace

TEST_SUITE("host_sim.certificate_check") {
  TEST_CASE("separation: the gap is that of all vertices, for a direction of any length") {
    const OraclePiece a = piece_of(box(0.02, 0.03, 0.04)), b = piece_of(box(0.1, 0.06, 0.05));
    const CertificateCheck check(a, b);
    const OraclePose pose{{}, {0.13, 0, 0}};
    CHECK(std::abs(check.gap_m(pose, {1, 0, 0}) - 0.01L) < 1e-17L);
    CHECK(std::abs(check.gap_m(pose, {7, 0, 0}) - 0.01L) < 1e-17L);
    CHECK(check.gap_m(pose, {-1, 0, 0}) < 0);
    CHECK(check.gap_m(pose, {0, 1, 0}) < 0);
    CHECK(std::isinf(check.gap_m(pose, {0, 0, 0})));
    CHECK(std::isinf(check.gap_m(pose, {std::nanl(""), 0, 0})));
    // A turned by a quarter about z: its y extent along x.
    const OraclePose turned{rotation_of(1, 0, 0, 1), {0.14, 0, 0}};
    CHECK(std::abs(check.gap_m(turned, {1, 0, 0}) - 0.01L) < 1e-17L);
    const WideVec between = check.between_centres(pose);
    CHECK(std::abs(between.x - 0.13L) < 1e-17L);
    CHECK(std::abs(between.y) < 1e-17L);
  }

  TEST_CASE("collision: x in the tetrahedron, outside it, and vertices that do not exist") {
    const OraclePiece a = piece_of(box(0.02, 0.02, 0.02)), b = piece_of(box(0.1, 0.1, 0.1));
    const CertificateCheck check(a, b);
    // Three corners of the C-obstacle, a box of half width 0.12: those at +x.
    PortalVertices portal;
    const WideVec corners[] = {{1, -1, -1}, {1, 1, -1}, {1, 0.9L, 1}};
    for (std::size_t k = 0; k < 3; ++k) {
      portal.a[k] = corner(a, -0.02L * corners[k]);
      portal.b[k] = corner(b, 0.1L * corners[k]);
    }
    const auto at = [&](Wide x, Wide y, Wide z) {
      return check.collision({{}, {x, y, z}}, portal);
    };
    CHECK(at(0.1L, 0.05L, -0.02L).inside);
    CHECK(at(0.1L, 0.05L, -0.02L).holds());
    const CollisionCertificate beyond = at(0.13L, 0.05L, -0.02L);
    CHECK_FALSE(beyond.inside);
    CHECK_FALSE(beyond.holds());
    CHECK(std::abs(beyond.distance_m - 0.01L) < 1e-17L);
    CHECK_FALSE(at(-0.05L, 0, 0).holds());
    CHECK(std::abs(at(-0.05L, 0, 0).distance_m - 0.05L) < 1e-17L);
    CHECK_FALSE(at(0.1L, -0.05L, 0.05L).holds());  // in the C-obstacle, but in another part of it
    CHECK(at(0.12L + 1e-17L, 0.05L, -0.02L).holds());  // rounding
    CHECK_FALSE(at(0.12L + (HAPTIC_REAL_IS_FLOAT ? 1e-5L : 1e-14L), 0.05L, -0.02L).holds());
    portal.b[1] = 8;
    CHECK_FALSE(at(0.1L, 0.05L, -0.02L).holds());
  }

  TEST_CASE("collision: a flat tetrahedron holds nothing but itself") {
    const OraclePiece a = piece_of(box(0.02, 0.02, 0.02)), b = piece_of(box(0.1, 0.1, 0.1));
    const CertificateCheck check(a, b);
    PortalVertices portal;
    const WideVec corners[] = {{1, 1, 1}, {1, 1, 1}, {1, 1, -1}};
    for (std::size_t k = 0; k < 3; ++k) {
      portal.a[k] = corner(a, -0.02L * corners[k]);
      portal.b[k] = corner(b, 0.1L * corners[k]);
    }
    const CollisionCertificate on = check.collision({{}, {0.06, 0.06, 0.01}}, portal);
    CHECK_FALSE(on.inside);
    CHECK(on.holds());
    CHECK_FALSE(check.collision({{}, {0.06, 0.05, 0.01}}, portal).holds());
    CHECK_FALSE(check.collision({{}, {0.13, 0.13, 0.13}}, portal).holds());
  }

  TEST_CASE("sieve: the same truth as the search in long double throughout") {
    const OraclePiece pieces[] = {piece_of(tetrahedron()), piece_of(box(0.04, 0.03, 0.05)),
                                  piece_of(prism(12, 0.04, 0.03))};
    const OraclePiece b = piece_of(box(0.1, 0.06, 0.05));
    Random random(11);
    for (const OraclePiece& a : pieces) {
      SiftedPair sifted(a, b, 0.3L);
      for (int i = 0; i < 300; ++i) {
        const OraclePose pose = draw_pose(random, i);
        const PairTruth whole = search_pair(a, b, pose, 0.3L, kDouble);
        const PairTruth quick = sifted.search(pose, kDouble);
        CHECK(quick.reference_m == whole.reference_m);
        CHECK(quick.lower_m == whole.lower_m);
        CHECK(quick.upper_m == whole.upper_m);
      }
    }
  }

  TEST_CASE("sieve: no node that may be near is left out") {
    const OraclePiece a = piece_of(box(0.04, 0.03, 0.05)), b = piece_of(prism(7, 0.06, 0.05));
    SiftedPair sifted(a, b, 0.3L);
    Random random(12);
    int near = 0;
    for (int i = 0; i < 400; ++i) {
      const OraclePose pose = draw_pose(random, i);
      const Wide d = search_pair(a, b, pose, 0.3L, kDouble).reference_m;
      const Wide epsilon = i % 3 == 0 ? 1e-4L : 2e-3L;
      const std::vector<NodeValue> kept = sifted.near_candidates(pose, d, epsilon, 0, 1.5e-8L);
      for (const NodeValue& node : all_nodes(a, b, pose)) {
        if (node.sine < 1.5e-8L) continue;
        if (std::abs(node.depth_m - d) + std::max(node.violation_m, 0.0L) >= epsilon) continue;
        ++near;
        CHECK(std::any_of(kept.begin(), kept.end(),
                          [&](const NodeValue& k) { return k.node == node.node; }));
      }
    }
    CHECK(near > 1000);
  }
}
