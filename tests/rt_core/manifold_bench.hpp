// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A pair of pieces with the memory of a contact manifold, and everything that the contract says of
/// one, held against the oracle.

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "tests/support/manifold_oracle.hpp"

namespace haptic::test {

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

}  // namespace haptic::test
