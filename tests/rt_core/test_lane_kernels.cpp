// SPDX-License-Identifier: Apache-2.0
// The loops of the screen: the same bits on any processor, and bounds that hold.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <vector>

#include "rt_core/base/wide_lanes.hpp"
#include "rt_core/proxy/lane_kernels.hpp"
#include "tests/support/random.hpp"

using namespace haptic;
using namespace haptic::test;

namespace one_by_one {

using haptic::each_lane::all_lanes;
using haptic::each_lane::FloatLanes;
using haptic::each_lane::lanes_below;
using haptic::each_lane::larger;
using haptic::each_lane::load_floats;
using haptic::each_lane::smaller;
using haptic::each_lane::store_floats;
using haptic::each_lane::where_below;
#include "rt_core/proxy/lane_kernels.inc"

}  // namespace one_by_one

namespace {

constexpr std::uint32_t kFacets = 700, kQueries = 200, kRows = 60, kSamples = 40;
constexpr Real kRange_m = 4e-4_r;

Vec3 random_point(Random& random, double size_m) {
  Vec3 at;
  for (int x = 0; x < 3; ++x) at[x] = static_cast<Real>(size_m * random.uniform(-1, 1));
  return at;
}

Vec3 unit(const Vec3& of) { return of / std::sqrt(of.squaredNorm()); }

/// Triangles about 1 mm long, in a cube of 4 mm.
struct Soup {
  explicit Soup(Random& random) {
    for (std::uint32_t f = 0; f < kFacets; ++f) {
      const Vec3 middle = random_point(random, 2e-3);
      StaticFacet facet;
      facet.begin = static_cast<std::uint32_t>(corners.size());
      facet.count = 3;
      for (int c = 0; c < 3; ++c) corners.push_back(middle + random_point(random, 5e-4));
      const Vec3* const at = &corners[facet.begin];
      facet.normal = unit((at[1] - at[0]).cross(at[2] - at[0]));
      facet.offset_m = facet.normal.dot(at[0]);
      facets.push_back(facet);
    }
    Arena counting;
    FacetTree unplaced;
    unplaced.place(counting, kFacets);
    memory.resize(counting.used() / sizeof(Line) + 1);
    Arena arena(reinterpret_cast<std::byte*>(memory.data()));
    tree.place(arena, kFacets);
    tree.build(facets, corners);
  }
  struct alignas(64) Line {
    std::byte bytes[64];
  };
  std::vector<StaticFacet> facets;
  std::vector<Vec3> corners;
  std::vector<Line> memory;
  mutable FacetTree tree;
};

TriangleShape random_triangle(Random& random) {
  TriangleShape shape;
  const Vec3 middle = random_point(random, 2e-3);
  for (Vec3& corner : shape.corner_w) corner = middle + random_point(random, 5e-4);
  const Vec3* const at = shape.corner_w;
  shape.normal_w = unit((at[1] - at[0]).cross(at[2] - at[0]));
  for (int c = 0; c < 3; ++c) {
    const Vec3 across = unit((at[(c + 1) % 3] - at[c]).cross(shape.normal_w));
    shape.outward_w[c] = across.dot(at[(c + 2) % 3] - at[c]) > 0 ? Vec3(-across) : across;
  }
  return shape;
}

/// A point of a triangle, its corners among them.
Vec3 point_of(const Vec3* corner, Random& random) {
  double a = random.uniform(-0.3, 1.3), b = random.uniform(-0.3, 1.3);
  a = std::clamp(a, 0.0, 1.0);
  b = std::clamp(b, 0.0, 1.0 - a);
  return corner[0] + static_cast<Real>(a) * (corner[1] - corner[0]) +
         static_cast<Real>(b) * (corner[2] - corner[0]);
}

template <typename T>
void fill(T& of, Random& random, double size) {
  float* const all = reinterpret_cast<float*>(&of);
  for (std::size_t k = 0; k < sizeof(T) / sizeof(float); ++k) {
    all[k] = static_cast<float>(size * random.uniform(-1, 1));
  }
}

template <std::size_t kCount>
bool same_bits(const float (&l)[kCount], const float (&r)[kCount]) {
  return std::equal(l, l + kCount, r, [](float a, float b) {
    return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b);
  });
}

/// A row at a pose with three blocks one after the other, some of whose pairs are lost.
struct RandomRow {
  explicit RandomRow(Random& random) {
    for (auto& axis : row.corner) {
      for (Real& corner : axis) corner = static_cast<Real>(1e-2 * random.uniform(-1, 1));
    }
    row.origin_w = random_point(random, 1e-2);
    row.rounding_m = 1e-9f;
    for (ScreenBlock& block : blocks) {
      fill(block.normal, random, 1);
      fill(block.height_m, random, 1e-2);
    }
    p.x0_w = random_point(random, 1e-2);
    q.x0_w = p.x0_w + random_point(random, 1e-4);
  }
  ScreenRow row;
  std::array<ScreenBlock, 3> blocks{};
  std::array<std::uint32_t, 3> next{2, kNoFacet, 1};
  GripPose p{Vec3::Zero(), Quat::Identity(), Mat3::Identity()}, q = p;
};

}  // namespace

TEST_SUITE("rt_core.lane_kernels") {
  TEST_CASE("a row has the same bits on any processor") {
    Random random(3);
    for (std::uint32_t trial = 0; trial < kRows; ++trial) {
      RandomRow of(random);
      const RowSweep sweep{
          &of.row, of.blocks.data(), of.next.data(), &of.q, trial % 2 == 0 ? &of.p : nullptr, 0,
          1e-3f};
      std::vector<std::vector<ScreenLost>> lost_of;
      std::vector<RowSwept> swept_of;
      const auto sweep_by = [&](const auto& of_row) {
        std::vector<ScreenLost> memory(64);
        BoundedList<ScreenLost> lost(memory);
        swept_of.push_back(of_row(lost));
        lost_of.emplace_back(lost.begin(), lost.end());
      };
      sweep_by([&](auto& lost) { return one_by_one::sweep_row(sweep, lost); });
      sweep_by([&](auto& lost) { return LaneKernels{false}.sweep_row(sweep, lost); });
      sweep_by([&](auto& lost) { return LaneKernels{has_wide_lanes()}.sweep_row(sweep, lost); });
      CHECK(!lost_of[0].empty());
      for (std::size_t k = 1; k < lost_of.size(); ++k) {
        CHECK(swept_of[k].blocks == 3);
        CHECK(swept_of[k].least_m == swept_of[0].least_m);
        CHECK(swept_of[k].worst_m == swept_of[0].worst_m);
        REQUIRE(lost_of[k].size() == lost_of[0].size());
        for (std::size_t i = 0; i < lost_of[k].size(); ++i) {
          CHECK(lost_of[k][i].gap_m == lost_of[0][i].gap_m);
          CHECK(lost_of[k][i].block == lost_of[0][i].block);
          CHECK(lost_of[k][i].lane == lost_of[0][i].lane);
        }
      }
    }
  }

  TEST_CASE("planes are the same bits on any processor, and have the gaps that they are given") {
    Random random(4);
    for (std::uint32_t trial = 0; trial < kRows; ++trial) {
      PlaneBatch drawn{};
      fill(drawn.a_p, random, 1e-3);
      fill(drawn.a_q, random, 1e-3);
      fill(drawn.b, random, 1e-3);
      fill(drawn.direction, random, 0.577);
      const bool is_move = trial % 2 == 0;
      std::vector<PlaneBatch> chosen(3, drawn);
      one_by_one::choose_planes(chosen[0], is_move);
      LaneKernels{false}.choose_planes(chosen[1], is_move);
      LaneKernels{has_wide_lanes()}.choose_planes(chosen[2], is_move);
      for (const PlaneBatch& last : chosen) {
        const PlaneBatch& first = chosen.front();
        for (int x = 0; x < 3; ++x) CHECK(same_bits(first.normal[x], last.normal[x]));
        CHECK(same_bits(first.height_m, last.height_m));
        CHECK(same_bits(first.gap_p_m, last.gap_p_m));
        if (is_move) CHECK(same_bits(first.gap_q_m, last.gap_q_m));
      }
      const PlaneBatch& of = chosen.front();
      for (std::uint32_t k = 0; k < kFloatLanes; ++k) {
        const auto height = [&](const float(&corner)[3][kFloatLanes]) {
          double sum = 0;
          for (int x = 0; x < 3; ++x) {
            sum += static_cast<double>(of.normal[x][k]) * static_cast<double>(corner[x][k]);
          }
          return sum;
        };
        double of_b = -1, of_a = 1;
        for (const auto& corner : of.b) of_b = std::max(of_b, height(corner));
        for (const auto& corner : of.a_p) of_a = std::min(of_a, height(corner));
        CHECK(static_cast<double>(of.height_m[k]) == doctest::Approx(of_b).epsilon(1e-9));
        CHECK(std::abs(static_cast<double>(of.gap_p_m[k]) - (of_a - of_b)) < 1e-9);
      }
    }
  }

  TEST_CASE("corners, gaps and queries have the same bits on any processor") {
    Random random(6);
    const Soup soup(random);
    for (std::uint32_t trial = 0; trial < kRows; ++trial) {
      const RandomRow of(random);
      RowCorners corners[3];
      one_by_one::place_row(of.row, of.p, corners[0]);
      LaneKernels{false}.place_row(of.row, of.p, corners[1]);
      LaneKernels{has_wide_lanes()}.place_row(of.row, of.p, corners[2]);
      float gap_m[3][kFloatLanes];
      one_by_one::block_gaps(of.blocks[0], corners[0], gap_m[0]);
      LaneKernels{false}.block_gaps(of.blocks[0], corners[1], gap_m[1]);
      LaneKernels{has_wide_lanes()}.block_gaps(of.blocks[0], corners[2], gap_m[2]);
      for (int k = 1; k < 3; ++k) {
        for (int x = 0; x < 3; ++x) CHECK(same_bits(corners[0].at[x], corners[k].at[x]));
        CHECK(same_bits(gap_m[0], gap_m[k]));
      }
    }
    std::vector<std::uint32_t> found[2] = {std::vector<std::uint32_t>(kFacets),
                                           std::vector<std::uint32_t>(kFacets)};
    for (std::uint32_t trial = 0; trial < kQueries; ++trial) {
      const TriangleShape triangle = random_triangle(random);
      const FacetTree::Found wide = soup.tree.find(triangle, kRange_m, found[0]);
      soup.tree.set_wide(false);
      const FacetTree::Found narrow = soup.tree.find(triangle, kRange_m, found[1]);
      soup.tree.set_wide(has_wide_lanes());
      REQUIRE(wide.count == narrow.count);
      CHECK(wide.others_m == narrow.others_m);
      CHECK(wide.leaves == narrow.leaves);
      CHECK(std::equal(found[0].begin(), found[0].begin() + wide.count, found[1].begin()));
    }
  }

  TEST_CASE("a tree finds all within range, and says how far the others are at least") {
    Random random(5);
    const Soup soup(random);
    std::vector<std::uint32_t> found(kFacets);
    std::size_t near = 0, others = 0;
    for (std::uint32_t trial = 0; trial < kQueries; ++trial) {
      const TriangleShape triangle = random_triangle(random);
      const FacetTree::Found result = soup.tree.find(triangle, kRange_m, found);
      CHECK(result.others_m >= kRange_m);
      std::vector<bool> is_found(kFacets, false);
      for (std::uint32_t k = 0; k < result.count; ++k) {
        is_found[soup.tree.order()[found[k]]] = true;
      }
      near += result.count;
      for (std::uint32_t f = 0; f < kFacets; ++f) {
        if (is_found[f]) continue;
        others += 1;
        for (std::uint32_t sample = 0; sample < kSamples; ++sample) {
          const Vec3 apart = point_of(triangle.corner_w, random) -
                             point_of(&soup.corners[soup.facets[f].begin], random);
          CHECK(std::sqrt(apart.squaredNorm()) >= result.others_m);
        }
      }
    }
    CHECK(near > kQueries);         // some are found
    CHECK(others > 10 * kQueries);  // and most are not
  }
}
