// SPDX-License-Identifier: Apache-2.0
// The independent judge of triangle meshes against closed forms, degenerate positions, other scales
// and an exhaustive search; and that it finds crossings that are there.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "host_sim/lab/surface_fuzz/fuzz_meshes.hpp"
#include "host_sim/oracle/mesh_pair.hpp"

using namespace haptic;
using namespace haptic::sim;

namespace {

constexpr Wide kScales[] = {1e-3L, 1, 1e3L};

Triangle scaled(Triangle t, Wide scale) {
  for (WideVec& v : t) v = scale * v;
  return t;
}

const Triangle kFlat{WideVec{0, 0, 0}, WideVec{1, 0, 0}, WideVec{0, 1, 0}};

struct Row {
  const char* words;
  Triangle other;
  bool meets;
  double distance;  ///< where they do not meet
  double depth;     ///< where they do
};
const Row kRows[] = {
    {"through the inside", {{{0.25L, 0.25L, -1}, {0.25L, 0.25L, 2}, {0.25L, 3, 2}}}, true, 0, 0.25},
    {"a corner below by 0.1",
     {{{0.2L, 0.2L, -0.1L}, {0.2L, 0.3L, 2}, {0.3L, 0.2L, 2}}},
     true,
     0,
     0.1},
    {"a corner above by 0.1",
     {{{0.2L, 0.2L, 0.1L}, {0.2L, 0.3L, 2}, {0.3L, 0.2L, 2}}},
     false,
     0.1,
     0},
    {"a corner on the face", {{{0.2L, 0.2L, 0}, {0.2L, 0.3L, 2}, {0.3L, 0.2L, 2}}}, true, 0, 0},
    {"a corner on the border", {{{0.5L, 0.5L, 0}, {0.5L, 0.5L, 2}, {2, 0.2L, 2}}}, true, 0, 0},
    {"corner on corner", {{{0, 0, 0}, {-1, 0, 1}, {-1, 1, 1}}}, true, 0, 0},
    {"a shared edge", {{{0, 0, 0}, {1, 0, 0}, {0, -1, 1}}}, true, 0, 0},
    {"the same triangle", kFlat, true, 0, 0},
    {"one inside the other, flat",
     {{{0.1L, 0.1L, 0}, {0.2L, 0.1L, 0}, {0.1L, 0.2L, 0}}},
     true,
     0,
     0},
    {"flat, overlapping", {{{0.2L, 0.2L, 0}, {2, 0.2L, 0}, {0.2L, 2, 0}}}, true, 0, 0},
    {"flat, side by side", {{{1.5L, 0, 0}, {2, 0, 0}, {2, 1, 0}}}, false, 0.5, 0},
    {"flat, border on border", {{{0, 0, 0}, {1, 0, 0}, {0, -1, 0}}}, true, 0, 0},
    {"parallel, 0.25 apart", {{{0, 0, 0.25L}, {1, 0, 0.25L}, {0, 1, 0.25L}}}, false, 0.25, 0},
    {"parallel edges, 0.5 apart", {{{0, -0.5L, 0}, {1, -0.5L, 0}, {0, -1, 2}}}, false, 0.5, 0},
    {"edge over edge, 0.1", {{{0.5L, -1, 0.1L}, {0.5L, 1, 0.1L}, {0.5L, 0, 2}}}, false, 0.1, 0},
    {"edge under edge by 0.1", {{{0.5L, -1, 0.1L}, {0.5L, 2, -0.2L}, {0.5L, 0, 3}}}, true, 0, -1},
    {"corner off a corner", {{{2, 2, 1}, {3, 2, 1}, {2, 3, 1}}}, false, std::sqrt(5.5), 0},
};

Triangle random_triangle(Seeded& random, double size) {
  Triangle t;
  for (WideVec& v : t) {
    v = {widen(random.uniform(-size, size)), widen(random.uniform(-size, size)),
         widen(random.uniform(-size, size))};
  }
  return t;
}

/// Smallest distance over a fine grid of points of both: never below the true one.
Wide sampled_distance(const Triangle& a, const Triangle& b, int cells) {
  const auto points = [&](const Triangle& t) {
    std::vector<WideVec> list;
    for (int i = 0; i <= cells; ++i) {
      for (int j = 0; i + j <= cells; ++j) {
        const Wide s = static_cast<Wide>(i) / cells, u = static_cast<Wide>(j) / cells;
        list.push_back(t[0] + s * (t[1] - t[0]) + u * (t[2] - t[0]));
      }
    }
    return list;
  };
  Wide best = std::numeric_limits<Wide>::infinity();
  const std::vector<WideVec> of_b = points(b);
  for (const WideVec& p : points(a)) {
    for (const WideVec& q : of_b) best = std::min(best, norm(p - q));
  }
  return best;
}

OraclePose at(Wide x, Wide y, Wide z) { return {WideRotation{}, {x, y, z}}; }

MeshPair pair_of(const FuzzMesh& moving, const FuzzMesh& fixed) {
  return {triangles_of(moving), triangles_of(fixed)};
}

}  // namespace

TEST_SUITE("host_sim.mesh_pair") {
  TEST_CASE("triangles: meet, distance and depth of known positions, either way round, any scale") {
    for (const Wide scale : kScales) {
      for (const Row& row : kRows) {
        const Triangle a = scaled(kFlat, scale);
        Triangle b = scaled(row.other, scale);
        for (int turn = 0; turn < 6; ++turn) {
          INFO(row.words << ", scale " << static_cast<double>(scale) << ", turn " << turn);
          CHECK(triangles_meet(a, b) == row.meets);
          CHECK(triangles_meet(b, a) == row.meets);
          const auto distance = static_cast<double>(triangle_distance(a, b) / scale);
          CHECK(distance == doctest::Approx(row.distance).epsilon(1e-15));
          CHECK(std::abs(triangle_distance(b, a) / scale - triangle_distance(a, b) / scale) <
                1e-15L);
          const Wide gap = triangle_gap(a, b, std::numeric_limits<Wide>::infinity()).gap_m / scale;
          if (row.meets && row.depth >= 0) {
            CHECK(static_cast<double>(-gap) == doctest::Approx(row.depth).epsilon(1e-15));
          }
          CHECK((gap > 1e-17L) == !row.meets);  // but for rounding
          CHECK(static_cast<double>(gap) <= row.distance + 1e-15);
          if (turn == 2) std::swap(b[0], b[1]);
          std::rotate(b.begin(), b.begin() + 1, b.end());
        }
      }
    }
  }

  TEST_CASE("triangles: the sign of a volume is exact where rounding has no say") {
    const auto off = [&](Wide by) {
      WideVec d = {1, 1, 1};
      d.z += by;
      return d;
    };
    const WideVec p{1, 0, 0}, q{0, 1, 0}, r{1, 1, 1};
    const Wide ulp = std::numeric_limits<Wide>::epsilon();
    // The plane x + y - z = 1 holds p, q, r and (1, 1, 1).
    CHECK(volume_sign(p, q, r, off(0)) == 0);
    CHECK(volume_sign(p, q, WideVec{0, 0, -1}, off(0)) == 0);
    const int above = volume_sign(p, q, WideVec{0, 0, -1}, off(ulp));
    CHECK(above != 0);
    CHECK(volume_sign(p, q, WideVec{0, 0, -1}, off(-ulp / 2)) == -above);
    CHECK(volume_sign(q, p, WideVec{0, 0, -1}, off(ulp)) == -above);
    // The same far from the origin, where products do not fit any more.
    const WideVec far{0x1p40L, 0x1p41L, 0x1p40L + 0x1p41L};
    CHECK(volume_sign(far + p, far + q, far + WideVec{0, 0, -1}, far + off(0)) == 0);
    CHECK(volume_sign(far + p, far + q, far + WideVec{0, 0, -1}, far + off(0x1p-20L)) == above);
  }

  TEST_CASE("triangles: the closed form is the distance of sampled points, at random") {
    Seeded random(3);
    int apart = 0;
    for (int k = 0; k < 300; ++k) {
      const Triangle a = random_triangle(random, 1), b = random_triangle(random, 1.5);
      const Wide distance = triangle_distance(a, b), sampled = sampled_distance(a, b, 24);
      CHECK(distance <= sampled + 1e-15L);
      CHECK(sampled - distance < 0.3L);  // of the grid
      const Wide gap = triangle_gap(a, b, std::numeric_limits<Wide>::infinity()).gap_m;
      CHECK(gap <= distance + 1e-15L);
      CHECK((gap > 0) == (distance > 0));
      apart += distance > 0 ? 1 : 0;
    }
    CHECK(apart > 50);
    CHECK(apart < 290);
  }

  TEST_CASE("triangles: moved apart by their depth they touch, by less they cross") {
    Seeded random(4);
    int crossing = 0;
    for (int k = 0; k < 2000; ++k) {
      Triangle a = random_triangle(random, 1);
      const Triangle b = random_triangle(random, 1);
      const TriangleGap gap = triangle_gap(a, b, std::numeric_limits<Wide>::infinity());
      if (!(gap.gap_m < -1e-6L)) continue;
      ++crossing;
      CHECK(triangles_meet(a, b));
      const WideVec n = gap.sign * *triangle_direction(a, b, gap.direction);
      const auto shifted = [&](Wide by) {
        Triangle t = a;
        for (WideVec& v : t) v = v + by * n;
        return t;
      };
      CHECK(triangles_meet(shifted(-gap.gap_m - 1e-9L), b));
      CHECK_FALSE(triangles_meet(shifted(-gap.gap_m + 1e-9L), b));
    }
    CHECK(crossing > 300);
  }

  TEST_CASE("triangles: no area in a line and in a point, however it lies") {
    CHECK(has_no_area({WideVec{0, 0, 0}, WideVec{1, 2, 3}, WideVec{2, 4, 6}}));
    CHECK(has_no_area({WideVec{1, 1, 1}, WideVec{1, 1, 1}, WideVec{1, 1, 1}}));
    CHECK_FALSE(has_no_area({WideVec{0, 0, 0}, WideVec{1, 2, 3}, WideVec{2, 4, 6 + 1e-18L}}));
    CHECK_FALSE(has_no_area(kFlat));
    const MeshPair pair({kFlat, {WideVec{0, 0, 0}, WideVec{1, 2, 3}, WideVec{2, 4, 6}}}, {kFlat});
    CHECK(pair.left_out() == 1);
    CHECK(pair.crossing(at(0, 0, 1)).meeting == 0);
  }

  TEST_CASE("meshes: gap and depth of two boxes are the closed form's, at every scale") {
    for (const double scale : {1e-3, 1.0, 1e3}) {
      const Wide s = widen(scale);
      const MeshPair pair = pair_of(box_mesh_of(scale * Vector(0.01, 0.01, 0.01)),
                                    box_mesh_of(scale * Vector(0.02, 0.02, 0.02)));
      INFO("scale " << scale);
      const auto distance = [&](Wide x, Wide y, Wide z) {
        return static_cast<double>(pair.distance_m(at(s * x, s * y, s * z), s) / s);
      };
      CHECK(distance(0, 0, 0.0305L) == doctest::Approx(5e-4));
      CHECK(distance(0.034L, 0.033L, 0) == doctest::Approx(5e-3));
      CHECK(distance(0.032L, 0.032L, 0.031L) == doctest::Approx(3e-3));
      CHECK(distance(0, 0, 3) == doctest::Approx(1));  // as far as was asked for
      CHECK(distance(0, 0, 0.029L) == 0);
      CHECK(pair.crossing(at(0, 0, s * 0.0305L)).meeting == 0);
      const MeshCrossing deep = pair.crossing(at(0, 0, s * 0.0299L));
      CHECK(deep.meeting > 0);
      CHECK(static_cast<double>(deep.depth_m / s) == doctest::Approx(1e-4));
    }
  }

  TEST_CASE("meshes: the tree finds what every pair of triangles gives") {
    Seeded random(5);
    const FuzzMesh soup = soup_mesh(40, 0.02, 0.01, 6);
    const FuzzMesh wavy = wavy_mesh(0.04, 12, 0.004, 2);
    const std::vector<Triangle> moving = triangles_of(soup), fixed = triangles_of(wavy);
    const MeshPair pair(moving, fixed);
    int meeting = 0;
    for (int k = 0; k < 20; ++k) {
      const Vector p = 0.03 * random.direction();
      const Rotation q = random.rotation();
      const OraclePose pose{rotation_of(widen(q.w()), widen(q.x()), widen(q.y()), widen(q.z())),
                            {widen(p[0]), widen(p[1]), widen(p[2])}};
      Wide depth = 0, distance = 0.01L;
      std::uint64_t meets = 0;
      for (const Triangle& t : moving) {
        const Triangle a{pose.x + pose.r * t[0], pose.x + pose.r * t[1], pose.x + pose.r * t[2]};
        for (const Triangle& b : fixed) {
          if (triangles_meet(a, b)) {
            ++meets;
            depth = std::max(depth, -triangle_gap(a, b, 1).gap_m);
          }
          distance = std::min(distance, triangle_distance(a, b));
        }
      }
      const MeshCrossing found = pair.crossing(pose);
      CHECK(found.meeting == meets);
      CHECK(found.depth_m == depth);
      CHECK(std::abs(pair.distance_m(pose, 0.01L) - distance) < 1e-17L);
      meeting += meets > 0 ? 1 : 0;
    }
    CHECK(meeting > 5);
  }

  TEST_CASE("ways: a sheet is crossed though both ends are free, straight and by a turn") {
    const FuzzMesh sheet = wavy_mesh(0.05, 4, 0, 1);
    const FuzzMesh ball = sphere_mesh(0.002, 1);
    const MeshPair pair = pair_of(ball, sheet);
    const Wide allowed = 4e-9L;
    const StraightWay through{at(0.011L, 0.007L, 0.01L), {0, 0, -0.02L}, {}};
    CHECK(pair.crossing(through.from).meeting == 0);
    CHECK(pair.crossing(through.at(1)).meeting == 0);
    CHECK(pair.passage(through, allowed, allowed / 50).gap_m < -1e-5L);
    const StraightWay along{at(0.011L, 0.007L, 0.01L), {0.01L, 0, 0}, {}};
    CHECK(pair.passage(along, allowed, allowed / 50).gap_m == 0);
    // A bar turned through the sheet about an axis in its middle; and about its own axis.
    const MeshPair bar = pair_of(box_mesh_of({0.03, 0.001, 0.001}), wavy_mesh(0.02, 4, 0, 1));
    const StraightWay swing{at(0, 0, 0.01L), {}, {0, 1.2L, 0}};
    CHECK(bar.passage(swing, allowed, allowed / 50).gap_m < -1e-4L);
    const StraightWay roll{at(0, 0, 0.01L), {}, {1.2L, 0, 0}};
    CHECK(bar.passage(roll, allowed, allowed / 50).gap_m == 0);
  }

  TEST_CASE("ways: over a face at less than the bend of the chord, and past an edge") {
    // A box turns about the vertical on a sheet, 1e-8 m above it: free all the way.
    const MeshPair box = pair_of(box_mesh_of({0.02, 0.015, 0.01}), wavy_mesh(0.05, 4, 0, 1));
    const StraightWay turn{at(0.001L, 0.002L, 0.01L + 1e-8L), {0.002L, 0, 0}, {0, 0, 0.02L}};
    const MeshPassage free = box.passage(turn, 1e-9L, 1e-10L);
    CHECK(free.gap_m == 0);
    CHECK(free.unproven == 0);
    // It rolls over an edge, which is lowest in the middle of the way, by 3.6e-6 m.
    const Wide upright = std::atan(1.5L), reach = std::sqrt(0.015L * 0.015L + 0.01L * 0.01L);
    StraightWay rock{at(0, 0, reach + 1e-8L), {}, {0.04L, 0, 0}};
    const Wide half = (upright - 0.02L) / 2;
    rock.from.r = rotation_of(std::cos(half), std::sin(half), 0, 0);
    CHECK(box.passage(rock, 1e-9L, 1e-10L).gap_m == 0);
    rock.from.x.z = reach - 1e-6L;
    CHECK(box.crossing(rock.from).meeting == 0);
    CHECK(box.crossing(rock.at(1)).meeting == 0);
    CHECK(static_cast<double>(box.passage(rock, 1e-9L, 1e-10L).gap_m) ==
          doctest::Approx(-1e-6).epsilon(0.01));
    // A tip past the border of the sheet by 1e-6 m, and over it by as much.
    const FuzzMesh corner_first{
        "tip", {{0, 0, 0}, {0.01, 0.002, 0.003}, {0.01, -0.002, 0.003}}, {{{0, 1, 2}}}, false};
    const MeshPair tip = pair_of(corner_first, wavy_mesh(0.05, 1, 0, 1));
    const StraightWay past{at(0.050001L, 0, 0.005L), {0, 0, -0.01L}, {}};
    CHECK(tip.passage(past, 1e-9L, 1e-10L).gap_m == 0);
    const StraightWay cuts{at(0.049999L, 0, 0.005L), {0, 0, -0.01L}, {}};
    CHECK(tip.passage(cuts, 1e-9L, 1e-10L).gap_m < -1e-9L);
  }

  TEST_CASE("closed meshes are closed: every edge is there once each way") {
    const FuzzMesh closed[] = {box_mesh_of({1, 2, 3}),    cylinder_mesh(7, 1, 2),
                               tube_mesh(9, 1, 2, 1),     ell_mesh(2, 0.5, 1),
                               sphere_mesh(1, 2),         drawer_mesh({3, 2, 1}, 0.1),
                               slotted_mesh(5, 2, 1, 0.5)};
    for (const FuzzMesh& mesh : closed) {
      INFO(mesh.name);
      CHECK(mesh.closed);
      std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
      Wide volume = 0;
      for (const auto& t : mesh.triangles) {
        for (std::size_t k = 0; k < 3; ++k) edges.emplace_back(t[k], t[(k + 1) % 3]);
      }
      for (const Triangle& t : triangles_of(mesh)) volume += dot(t[0], cross(t[1], t[2]));
      CHECK(volume > 0);
      std::ranges::sort(edges);
      CHECK(std::ranges::adjacent_find(edges) == edges.end());
      CHECK(std::ranges::all_of(edges, [&](const auto& e) {
        return std::ranges::binary_search(edges, std::pair(e.second, e.first));
      }));
    }
  }
}
