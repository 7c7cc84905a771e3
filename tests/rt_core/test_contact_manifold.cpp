// SPDX-License-Identifier: Apache-2.0

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "tests/support/manifold_oracle.hpp"

using namespace haptic;
using namespace haptic::test;

namespace {

// A pair of pieces with the memory of a contact manifold, and everything that the contract says of
// one, held against the oracle.

inline constexpr double kHeight_m = 2e-3;  ///< of the manifolds

/// A pair with manifold memory, and the last manifold made.
struct ManifoldBench {
  ManifoldBench(const tools::Body& a, const tools::Body& b) : bench(a, b) {
    const PairView& pair = *bench.at({0, 0, 0}, {1, 0, 0, 0}).pair;
    std::uint32_t largest[2] = {0, 0};
    const PieceView* const pieces[2] = {&pair.a, &pair.b};
    for (std::size_t side = 0; side < 2; ++side) {
      for (std::uint32_t f = 0; f < pieces[side]->face_count; ++f)
        largest[side] = std::max(largest[side], pieces[side]->faces[f].loop_count);
    }
    Arena counting;
    scratch.place(counting, largest[0], largest[1]);
    memory.resize(counting.used() / sizeof(std::max_align_t) + 1);
    Arena arena(reinterpret_cast<std::byte*>(memory.data()));
    scratch.place(arena, largest[0], largest[1]);
  }
  PlaneGap gap_at(const PlaneId& id) {
    const PairPose& pose = bench.pose();
    return plane_gap(*pose.pair, pose.r_wa, pose.y_w, id, {});
  }
  std::uint32_t make(const PlaneId& id) {
    const PairPose& pose = bench.pose();
    gap = gap_at(id);
    REQUIRE(gap.defined);
    count = contact_manifold(*pose.pair, pose.r_wa, pose.y_w, gap, static_cast<Real>(kHeight_m),
                             scratch, points);
    return count;
  }
  /// Position of a point in the axes of B's reference [m].
  [[nodiscard]] Vec3 place(std::uint32_t k) const { return bench.pose().y_w + points[k].app_w; }
  [[nodiscard]] bool has(const Vec3& p, Real tolerance = 2e-7_r) const {
    for (std::uint32_t k = 0; k < count; ++k)
      if ((place(k) - p).norm() <= tolerance) return true;
    return false;
  }
  PairBench bench;
  ManifoldScratch scratch;
  std::vector<std::max_align_t> memory;
  PlaneGap gap;
  std::array<ManifoldPoint, kMaxManifoldPoints> points;
  std::uint32_t count = 0;
};

inline constexpr Real kRounding = 400 * kRealEpsilon * 0.1_r;

/// The plane with the largest gap.
inline PlaneId best_plane(ManifoldBench& m) {
  PlaneId best;
  Real most = -1;
  for (const PlaneId& id : all_planes(*m.bench.pose().pair)) {
    const PlaneGap gap = m.gap_at(id);
    if (gap.defined && gap.gap_m > most) {
      most = gap.gap_m;
      best = id;
    }
  }
  return best;
}

struct Tally {
  int regions = 0, disjoint = 0, single = 0, doubtful = 0;
};

/// Everything the contract says about the manifold along `id` at the bench's pose.
inline void check_manifold(ManifoldBench& m, const PlaneId& id, Tally& tally) {
  m.make(id);
  const PairPose& pose = m.bench.pose();
  REQUIRE(m.count >= 1);
  REQUIRE(m.count <= kMaxManifoldPoints);
  const ManifoldPoint support = support_row_point(*pose.pair, pose.r_wa, pose.y_w, m.gap);
  const ManifoldOracle oracle(pose, id, m.gap, kHeight_m);
  ExactPolygon spots;
  for (std::uint32_t k = 0; k < m.count; ++k) {
    REQUIRE(m.points[k].app_w.allFinite());
    REQUIRE(std::isfinite(m.points[k].gap_m));
    CHECK(m.points[k].gap_m >= m.gap.gap_m - kRounding);
    spots.push_back(oracle.spot(m.points[k].app_w));
  }
  if (oracle.doubtful()) {
    ++tally.doubtful;
    return;
  }
  const Exact size = static_cast<Exact>(pose.size_m);
  const Exact width = 2 * static_cast<Exact>(applicability_tolerance(pose.size_m));
  const Exact merge = std::max<Exact>(4e-6L * size, width);
  const ExactPolygon region = intersection_of(oracle.feature_a(), oracle.feature_b(), 0);
  const bool is_support = m.count == 1 && m.points[0].gap_m == m.gap.gap_m &&
                          (m.points[0].app_w - support.app_w).norm() == 0;
  if (region.empty() && is_support) {
    ++tally.disjoint;
    return;
  }
  if (!m.scratch.overlap && id.type != ContactType::kC) {
    // Corners of the feature across from the face, the support vertex among them.
    ++tally.disjoint;
    const ExactPolygon& across =
        id.type == ContactType::kB ? oracle.feature_a() : oracle.feature_b();
    const ExactPoint lowest = oracle.spot(support.app_w);
    Exact nearest = std::numeric_limits<Exact>::max();
    for (const ExactPoint& spot : spots) {
      CHECK(distance_from(across, spot) <= width);
      nearest = std::min(nearest, std::hypot(spot.x - lowest.x, spot.y - lowest.y));
    }
    CHECK(nearest <= merge);
    CHECK(m.count <= std::max<std::size_t>(across.size(), 1));
    return;
  }
  ++(m.count == 1 ? tally.single : tally.regions);
  for (std::uint32_t k = 0; k < m.count; ++k) {
    // In both features, at the height the type says, with the gap of that place.
    CHECK(distance_from(oracle.feature_a(), spots[k]) <= width);
    CHECK(distance_from(oracle.feature_b(), spots[k]) <= width);
    const Exact a = oracle.height_a(spots[k]), b = oracle.height_b(spots[k]);
    CHECK(std::abs(a - b - static_cast<Exact>(m.points[k].gap_m)) <= 10 * kRounding);
    const Exact expected = id.type == ContactType::kA   ? b
                           : id.type == ContactType::kB ? a
                                                        : (a + b) / 2;
    CHECK(std::abs(oracle.height(m.points[k].app_w) - expected) <= 10 * kRounding);
  }
  // Nothing of the region is missing; a region cut to 16 points still has almost all of it.
  const ExactPolygon outline = hull_of(region);
  if (m.count < kMaxManifoldPoints) {
    for (const ExactPoint& c : region) {
      Exact nearest = std::numeric_limits<Exact>::max();
      for (const ExactPoint& p : spots)
        nearest = std::min(nearest, std::hypot(p.x - c.x, p.y - c.y));
      CHECK(std::min(nearest, distance_from(hull_of(spots), c)) <= merge);
    }
  } else {
    CHECK(area_of(hull_of(spots)) >= 0.96L * area_of(outline));
  }
  Exact least = std::numeric_limits<Exact>::max();
  for (const ExactPoint& c : region)
    least = std::min(least, oracle.height_a(c) - oracle.height_b(c));
  Real least_gap = m.points[0].gap_m;
  for (std::uint32_t k = 1; k < m.count; ++k) least_gap = std::min(least_gap, m.points[k].gap_m);
  if (!region.empty()) CHECK(static_cast<Exact>(least_gap) <= least + 10 * kRounding);
}

using Rotation = std::array<double, 4>;
constexpr double kPi = 3.14159265358979323846;

Rotation times(const Rotation& p, const Rotation& q) {
  return {p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3],
          p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
          p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1],
          p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0]};
}
Rotation turn(double angle, double x, double y, double z) {
  const double s = std::sin(angle / 2) / std::sqrt(x * x + y * y + z * z);
  return {std::cos(angle / 2), s * x, s * y, s * z};
}

tools::Body cube() { return box({-0.05, -0.05, -0.05}, {0.05, 0.05, 0.05}); }
/// Top of `cube` as a plane of B: its face 1 looks along +z.
constexpr PlaneId kTop{ContactType::kB, 0, 1, false};

}  // namespace

TEST_SUITE("rt_core.contact_manifold") {
  TEST_CASE("plane_gap is the least height over all vertices along the normal of the definition") {
    ManifoldBench m(random_hull(5, 30, {0.04, 0.05, 0.03}), prism(12, 0.04, 0.08));
    Random random(71);
    for (int k = 0; k < 6; ++k) {
      const PairPose& pose = m.bench.at({random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1), 0.1},
                                        random.rotation());
      const PairView& pair = *pose.pair;
      for (const PlaneId& id : all_planes(pair)) {
        const PlaneGap gap = m.gap_at(id);
        const Vec3 u = pose.r_wa * ConstVec3Map(pair.a.edge_directions[id.i].unit);
        const Vec3 v = ConstVec3Map(pair.b.edge_directions[id.j].unit);
        if (id.type == ContactType::kC && u.cross(v).norm() < 2 * kMinEdgeSine) continue;
        REQUIRE(gap.defined);
        const Vec3 n = id.type == ContactType::kA   ? Vec3(-(pose.r_wa * pair.a.face_normal(id.i)))
                       : id.type == ContactType::kB ? pair.b.face_normal(id.j)
                       : id.flipped                 ? Vec3(-u.cross(v).normalized())
                                                    : Vec3(u.cross(v).normalized());
        CHECK((gap.normal_w - n).norm() <= 4 * kRealEpsilon);
        CHECK((pose.r_wa * gap.normal_a - n).norm() <= 8 * kRealEpsilon);
        Real low = std::numeric_limits<Real>::max(), high = -low;
        for (std::uint32_t a = 0; a < pair.a.vertex_count; ++a)
          low = std::min(low, n.dot(pose.vertex_a(a) + pose.y_w));
        for (std::uint32_t b = 0; b < pair.b.vertex_count; ++b)
          high = std::max(high, n.dot(pose.vertex_b(b)));
        CHECK(std::abs(gap.gap_m - (low - high)) <= kRounding);
        CHECK(std::abs(n.dot(pose.vertex_a(gap.support.a) + pose.y_w) - low) <= kRounding);
        CHECK(std::abs(n.dot(pose.vertex_b(gap.support.b)) - high) <= kRounding);
      }
    }
    m.bench.at({0, 0, 0.1}, {1, 0, 0, 0});
    ManifoldBench aligned(cube(), cube());
    aligned.bench.at({0, 0, 0.1}, {1, 0, 0, 0});
    CHECK_FALSE(aligned.gap_at({ContactType::kC, 0, 0, false}).defined);
  }

  TEST_CASE("box on box: the common rectangle, and eight corners when turned by 45 degrees") {
    ManifoldBench m(cube(), cube());
    const Vec3 reference = Vec3(m.bench.pose().pair->b.vertex(7)) - Vec3(0.05_r, 0.05_r, 0.05_r);
    m.bench.at({0.02, 0.03, 0.101}, {1, 0, 0, 0});
    CHECK(m.make(kTop) == 4);
    for (const Real x : {-0.03_r, 0.05_r}) {
      for (const Real y : {-0.02_r, 0.05_r}) {
        CHECK(m.has(reference + Vec3(x, y, 0.051_r)));  // kB: on A
      }
    }
    for (std::uint32_t k = 0; k < 4; ++k) CHECK(std::abs(m.points[k].gap_m - 1e-3_r) < kRounding);
    CHECK(m.make({ContactType::kA, 0, 0, false}) == 4);
    CHECK(m.has(reference + Vec3(0.05_r, -0.02_r, 0.05_r)));  // kA: on B

    m.bench.at({0, 0, 0.1}, {1, 0, 0, 0});  // same outline: no point twice
    CHECK(m.make(kTop) == 4);
    m.bench.at({0, 0, 0.1}, turn(kPi / 4, 0, 0, 1));
    CHECK(m.make(kTop) == 8);
    const Real near = 0.05_r * (std::sqrt(2.0_r) - 1);
    for (const Real s : {-1.0_r, 1.0_r}) {
      for (const Real t : {-1.0_r, 1.0_r}) {
        CHECK(m.has(reference + Vec3(s * 0.05_r, t * near, 0.05_r)));
        CHECK(m.has(reference + Vec3(s * near, t * 0.05_r, 0.05_r)));
      }
    }
    m.bench.at({0.2, 0, 0.101}, {1, 0, 0, 0});  // next to it: all corners of A's lower face
    CHECK(m.make(kTop) == 4);
    CHECK_FALSE(m.scratch.overlap);
    for (std::uint32_t k = 0; k < 4; ++k) CHECK(std::abs(m.points[k].gap_m - 1e-3_r) < kRounding);
  }

  TEST_CASE("tilted faces: every corner has its own gap, from 1e-9 rad to beyond the height") {
    ManifoldBench m(box({-0.03, -0.02, -0.05}, {0.03, 0.02, 0.05}), cube());
    for (const double tilt : {0.0, 1e-9, 1e-7, 1e-5, 1e-3, 0.02}) {
      CAPTURE(tilt);
      const Real t = static_cast<Real>(tilt);
      m.bench.at({0, 0, 0.1}, turn(tilt, 0, 1, 0));
      const PairPose& pose = m.bench.pose();
      CHECK(m.make(kTop) == 4);
      for (std::uint32_t v = 0; v < 4; ++v) {  // lower corners of A are the points
        const Vec3 corner = pose.y_w + pose.r_wa * pose.pair->a.vertex(v);
        CHECK(m.has(corner, kRounding));
      }
      std::array<Real, 4> gaps{};
      for (std::uint32_t k = 0; k < 4; ++k) gaps[k] = m.points[k].gap_m;
      std::sort(gaps.begin(), gaps.end());
      const Real half = 0.03_r * std::sin(t), fall = 0.05_r - 0.05_r * std::cos(t);
      CHECK(std::abs(gaps[0] - (fall - half)) < kRounding);
      CHECK(std::abs(gaps[3] - (fall + half)) < kRounding);
    }
    m.bench.at({0, 0, 0.1}, turn(0.05, 0, 1, 0));  // 3 mm: the lower edge alone
    CHECK(m.make(kTop) == 2);
    m.bench.at({0, 0, 0.11}, times(turn(0.6, 0, 1, 0), turn(0.6, 1, 0, 0)));
    CHECK(m.make(kTop) == 1);  // a corner
    CHECK(m.points[0].gap_m == m.gap.gap_m);
  }

  TEST_CASE("edge over a face: cut at the rim") {
    ManifoldBench m(box({-0.02, -0.08, -0.02}, {0.02, 0.08, 0.02}), cube());
    const Vec3 reference = Vec3(m.bench.pose().pair->b.vertex(7)) - Vec3(0.05_r, 0.05_r, 0.05_r);
    const double lower = 0.02 * std::sqrt(2.0);
    m.bench.at({0.01, 0.05, 0.05 + lower}, turn(kPi / 4, 0, 1, 0));
    CHECK(m.make(kTop) == 2);
    CHECK(m.has(reference + Vec3(0.01_r, -0.03_r, 0.05_r)));
    CHECK(m.has(reference + Vec3(0.01_r, 0.05_r, 0.05_r)));
    m.bench.at({0.06, 0.05, 0.05 + lower}, turn(kPi / 4, 0, 1, 0));
    CHECK(m.make(kTop) == 2);  // outside the rim: both ends of the edge
    CHECK_FALSE(m.scratch.overlap);
    CHECK(m.has(reference + Vec3(0.06_r, -0.03_r, 0.05_r)));
    CHECK(m.has(reference + Vec3(0.06_r, 0.13_r, 0.05_r)));
  }

  TEST_CASE("edge over edge: crossing, overlap of parallel ones, side by side") {
    // Triangular prisms, apex edge against apex edge. Their planes along x are those of A's apex
    // edge and an edge of B's back, which has the direction of y.
    ManifoldBench m(prism(3, 0.05, 0.1), prism(3, 0.05, 0.1));
    const auto along_x = [&] {
      for (const PlaneId& id : all_planes(*m.bench.pose().pair)) {
        const PlaneGap gap = m.gap_at(id);
        if (id.type == ContactType::kC && gap.defined && gap.normal_w[0] > 1 - 4 * kRealEpsilon)
          return id;
      }
      FAIL("no such plane");
      return PlaneId{};
    };
    const Vec3 apex = m.bench.at({0, 0, 0}, {1, 0, 0, 0}).pair->b.vertex(0) + Vec3(0, 0, 0.05_r);
    m.bench.at({0.1 + 1e-3, 0, 0.03}, turn(kPi, 0, 0, 1));
    CHECK(m.make(along_x()) == 2);
    CHECK(m.has(apex + Vec3(0.5e-3_r, 0, 0.05_r)));  // kC: midway
    CHECK(m.has(apex + Vec3(0.5e-3_r, 0, -0.02_r)));
    m.bench.at({0.1, 0.001, 0.03}, turn(kPi, 0, 0, 1));
    CHECK(m.make(along_x()) == 1);  // side by side
    CHECK(m.points[0].gap_m == m.gap.gap_m);

    int crossings = 0;
    for (const double angle : {0.002, 0.1, 1.0, kPi / 2}) {
      CAPTURE(angle);
      m.bench.at({0.1 + 1e-3, 0, 0.01}, times(turn(angle, 1, 0, 0), turn(kPi, 0, 0, 1)));
      PlaneId id = best_plane(m);
      if (id.type != ContactType::kC) continue;  // edges of one plane tie with another one
      ++crossings;
      CHECK(m.make(id) == 1);
      CHECK(m.has(apex + Vec3(0.5e-3_r, 0, 0.01_r), 1e-6_r));
      CHECK(std::abs(m.points[0].gap_m - 1e-3_r) < 10 * kRounding);
    }
    CHECK(crossings >= 3);
  }

  TEST_CASE("invariants at random poses of faces, edges and corners near each other") {
    const std::uint64_t seed = 2027;
    MESSAGE("seed " << seed);
    Random random(seed);
    const tools::Body bodies[] = {
        cube(), prism(12, 0.04, 0.08), box({-0.05, -0.0015, -0.0015}, {0.05, 0.0015, 0.0015}),
        tetrahedron({0.05, 0, -0.03}, {-0.03, 0.04, -0.03}, {-0.03, -0.04, -0.03}, {0, 0, 0.06})};
    Tally tally;
    for (std::size_t pair = 0; pair < 16; ++pair) {
      ManifoldBench m(bodies[pair % 4], bodies[pair / 4]);
      const std::vector<PlaneId> planes = all_planes(*m.bench.pose().pair);
      for (int k = 0; k < 120; ++k) {
        CAPTURE(pair);
        CAPTURE(k);
        Rotation q = random.rotation();
        if (k % 3 != 0) {
          const double tilt = std::pow(10.0, random.uniform(-12, -1.5));
          const double yaw =
              k % 3 == 1 ? random.uniform(-3, 3) : std::pow(10.0, random.uniform(-12, -5));
          q = times(turn(tilt, random.uniform(-1, 1), random.uniform(-1, 1), 0.1),
                    turn(yaw, 0, 0, 1));
        }
        Point x = {random.uniform(-0.06, 0.06), random.uniform(-0.06, 0.06), 0.15};
        if (k % 6 == 2) x[0] = x[1] = 0;  // equal outlines nearly coincide
        m.bench.at(x, q);
        // Down along z until the top of B is a hair away.
        const double down =
            static_cast<double>(m.gap_at(kTop).gap_m) - random.uniform(-1, 1) * 1e-3;
        if (pair / 4 != 3) x[2] -= down;
        m.bench.at(x, q);
        check_manifold(m, best_plane(m), tally);
        for (int other = 0; other < 4; ++other) {
          const PlaneId& id = planes[random.next() % planes.size()];
          if (m.gap_at(id).defined) check_manifold(m, id, tally);
        }
      }
    }
    MESSAGE("regions " << tally.regions << ", single points " << tally.single << ", disjoint "
                       << tally.disjoint << ", doubtful " << tally.doubtful);
    CHECK(tally.regions > 1000);
    CHECK(tally.single > 300);
    CHECK(tally.disjoint > 1000);
  }

  TEST_CASE("of corners that merge the one with the smaller gap stays") {
    // A is turned by 45 degrees and cuts each corner of B off by a side of 0.06 um.
    const double side = 0.05 * std::sqrt(2.0) - 3e-8;
    ManifoldBench m(box({-side, -side, 0}, {side, side, 0.1}), cube());
    Tally tally;
    for (int k = 0; k < 16; ++k) {
      CAPTURE(k);
      m.bench.at({0, 0, 0.05}, times(turn(1e-4, std::cos(0.4 * k), std::sin(0.4 * k), 0),
                                     turn(kPi / 4, 0, 0, 1)));
      check_manifold(m, kTop, tally);
      CHECK(m.count == 4);
    }
    CHECK(tally.regions == 16);
  }

  TEST_CASE("large faces keep the points that reach farthest and the smallest gap") {
    Tally tally;
    ManifoldBench m(prism(64, 0.05, 0.04), prism(64, 0.05, 0.04));
    for (const double shift : {0.0, 0.01, 0.05, 0.09}) {
      for (const double tilt : {0.0, 1e-6, 0.01}) {
        CAPTURE(shift);
        CAPTURE(tilt);
        m.bench.at({shift, 0, 0.0405}, times(turn(tilt, 0.3, 1, 0), turn(kPi / 64, 0, 0, 1)));
        check_manifold(m, kTop, tally);
        if (shift < 0.05) CHECK(m.count == kMaxManifoldPoints);
      }
    }
    CHECK(tally.regions == 12);
  }

  TEST_CASE("the roles of the two pieces do not matter") {
    const tools::Body bodies[] = {cube(), prism(7, 0.04, 0.08)};
    Random random(99);
    int compared = 0;
    ManifoldBench m(bodies[0], bodies[1]), swapped(bodies[1], bodies[0]);
    for (int k = 0; k < 400; ++k) {
      CAPTURE(k);
      const Rotation q =
          times(turn(k % 2 == 0 ? 1e-3 : 0.015, random.uniform(-1, 1), random.uniform(-1, 1), 0),
                turn(random.uniform(-3, 3), 0, 0, 1));
      const Point x = {random.uniform(-0.06, 0.06), random.uniform(-0.06, 0.06), 0.092};
      const PairPose pose = m.bench.at(x, q);
      const Vec3 x_w(static_cast<Real>(x[0]), static_cast<Real>(x[1]), static_cast<Real>(x[2]));
      const Vec3 back = -(pose.r_wa.transpose() * x_w);
      swapped.bench.at({static_cast<double>(back[0]), static_cast<double>(back[1]),
                        static_cast<double>(back[2])},
                       {q[0], -q[1], -q[2], -q[3]});
      const PlaneId id = best_plane(m);
      const PlaneId mirrored = id.type == ContactType::kC
                                   ? PlaneId{ContactType::kC, id.j, id.i, id.flipped}
                               : id.type == ContactType::kA ? PlaneId{ContactType::kB, 0, id.i}
                                                            : PlaneId{ContactType::kA, id.j, 0};
      m.make(id);
      swapped.make(mirrored);
      CHECK((m.gap.normal_w + pose.r_wa * swapped.gap.normal_w).norm() < 32 * kRealEpsilon);
      CHECK(std::abs(m.gap.gap_m - swapped.gap.gap_m) < kRounding);
      const ManifoldOracle oracle(pose, id, m.gap, kHeight_m);
      if (oracle.doubtful()) continue;
      ExactPolygon here, there;
      for (std::uint32_t p = 0; p < m.count; ++p) here.push_back(oracle.spot(m.points[p].app_w));
      for (std::uint32_t p = 0; p < swapped.count; ++p) {
        there.push_back(oracle.spot(pose.r_wa * (back + swapped.points[p].app_w)));
      }
      if (m.count == 1 || swapped.count == 1) {  // support vertices of a face may be any
        CHECK(m.count == swapped.count);
        continue;
      }
      ++compared;
      for (const ExactPoint& p : here) CHECK(distance_from(hull_of(there), p) < 1e-6L);
      for (const ExactPoint& p : there) CHECK(distance_from(hull_of(here), p) < 1e-6L);
    }
    CHECK(compared > 200);
  }
}
