// SPDX-License-Identifier: Apache-2.0
// Planes for lost and for new pairs, eight at a time.

#include <algorithm>
#include <cmath>

#include "rt_core/proxy/facet_screen.hpp"
#include "rt_core/proxy/lane_kernels.hpp"
#include "rt_core/proxy/screen_numbers.hpp"

namespace haptic {
namespace {

/// Along a direction for one lane.
void set_direction(float (&direction)[3][kFloatLanes], std::uint32_t lane,
                   const Vec3& of) noexcept {
  for (int x = 0; x < 3; ++x) direction[x][lane] = static_cast<float>(of[x]);
}

}  // namespace

bool FacetScreen::fits_batch(std::uint32_t facet) const noexcept {
  return b_.facets[facet].count <= PlaneBatch::kMostCorners;
}

/// Puts a pair into the next lane.
void FacetScreen::gather(PlaneBatch& batch, std::uint32_t row, std::uint32_t facet,
                         const GripPose& p, const GripPose* q) const noexcept {
  const std::uint32_t lane = batch.count++;
  const Row& of_a = a_.rows[row];
  const Shape& shape = a_.shape[row];
  const StaticFacet& of_b = b_.facets[facet];
  const auto place = [&](float(&to)[3][3][kFloatLanes], const GripPose& pose) {
    RowCorners corners;
    LaneKernels{is_wide_}.place_row(of_a, pose, corners);
    for (int c = 0; c < 3; ++c) {
      for (int x = 0; x < 3; ++x) to[c][x][lane] = corners.at[x][c];
    }
  };
  place(batch.a_p, p);
  if (q != nullptr) place(batch.a_q, *q);
  set_direction(batch.direction[0], lane, of_b.normal);
  set_direction(batch.direction[1], lane, p.r_wa * shape.normal);
  if (q != nullptr) set_direction(batch.direction[2], lane, q->r_wa * shape.normal);
  for (std::uint32_t c = 0; c < PlaneBatch::kMostCorners; ++c) {
    const std::uint32_t at = of_b.begin + std::min(c, of_b.count - 1);
    set_direction(batch.b[c], lane, b_.corners_w[at] - of_a.origin_w);
  }
}

/// The plane that was chosen for lane k. Corners of a large facet are far from the row, too far for
/// single precision: its height is taken again.
FacetScreen::Lane FacetScreen::lane_of(const PlaneBatch& batch, std::uint32_t k, const Row& row,
                                       std::uint32_t facet) const noexcept {
  return plane_lane(
      row, facet,
      Vec3(static_cast<Real>(batch.normal[0][k]), static_cast<Real>(batch.normal[1][k]),
           static_cast<Real>(batch.normal[2][k])));
}

/// Planes for lost pairs from `begin` on; each that gets one is marked.
void FacetScreen::search_batch(PlaneBatch& batch, std::uint32_t begin, std::uint32_t count,
                               const Way& way, bool is_move) noexcept {
  std::uint32_t of[kFloatLanes];
  batch.count = 0;
  for (std::uint32_t k = begin; k < begin + count; ++k) {
    const Lost& lost = lost_.pairs[k];
    const std::uint32_t facet = lists_.lanes[lost.block].facet[lost.lane];
    if (facet == kNoFacet || !fits_batch(facet)) continue;
    of[batch.count] = k;
    gather(batch, lost.row, facet, way.p, is_move ? &way.q : nullptr);
  }
  if (batch.count == 0) return;
  work_ += kBatchWork * batch.count;
  LaneKernels{is_wide_}.choose_planes(batch, is_move);
  for (std::uint32_t k = 0; k < batch.count; ++k) {
    Lost& lost = lost_.pairs[of[k]];
    const Row& row = a_.rows[lost.row];
    const float need_m =
        rounded_up(way.least_m + excess_m(lost.row, way) + static_cast<Real>(row.rounding_m));
    const Lane lane = lane_of(batch, k, row, lists_.lanes[lost.block].facet[lost.lane]);
    const float less_m = lane.height_m - batch.height_m[k];
    const float gap_p_m = batch.gap_p_m[k] - less_m, gap_q_m = batch.gap_q_m[k] - less_m;
    if (!(gap_p_m >= need_m && gap_q_m >= need_m)) continue;
    write(lost.block, lost.lane, lane);
    float& least = FacetScreen::of(gaps_.least_m, lost.row);
    least = std::min(least, rounded_down(gap_p_m - row.rounding_m));
    lost.is_found = true;
  }
}

/// Facets that come to the lists of a row.
void FacetScreen::put_batch(PlaneBatch& batch, const std::uint32_t* facets, std::uint32_t number,
                            const GripPose& p, LookUp& look) noexcept {
  if (batch.count == 0) return;
  Row& row = a_.rows[number];
  work_ += kBatchWork * batch.count;
  LaneKernels{is_wide_}.choose_planes(batch, false);
  for (std::uint32_t k = 0; k < batch.count; ++k) {
    const Lane lane = lane_of(batch, k, row, facets[k]);
    const Real gap_m =
        static_cast<Real>(batch.gap_p_m[k] - (lane.height_m - batch.height_m[k]) - row.rounding_m);
    if (gap_m < look.least_m) {
      put_alone(number, facets[k], p, look);
      continue;
    }
    if (gap_m > look.range_m) {
      look.others_m = std::min(look.others_m, gap_m);
      continue;
    }
    put(row, look, lane, gap_m);
  }
  batch.count = 0;
}

/// One that no face parts from a row by so much, or that has many corners.
void FacetScreen::put_alone(std::uint32_t number, std::uint32_t facet, const GripPose& p,
                            LookUp& look) noexcept {
  Row& row = a_.rows[number];
  const Real rounding_m = static_cast<Real>(row.rounding_m);
  const Placed at{{look.at.corner_w[0], look.at.corner_w[1], look.at.corner_w[2]}};
  Tried tried;
  Between between{number, facet};
  between.p = &p;
  between.at_p = &at;
  between.need_m = look.least_m + rounding_m;
  const bool has_plane = find_plane(between, tried) || find_closest(at, between, tried);
  const Real gap_m = tried.best.gap_p_m - rounding_m;
  if (has_plane) {
    put(row, look, plane_lane(row, facet, tried.best.normal_w), gap_m);
  } else if (!lost_.misses.push({number, a_.piece[number], b_.tree.order()[facet], gap_m})) {
    look.others_m = std::min(look.others_m, gap_m);
  }
}

}  // namespace haptic
