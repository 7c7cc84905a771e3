// SPDX-License-Identifier: Apache-2.0
// Lists of the screen: which facets are near a triangle, and the blocks that hold them.
#include <algorithm>
#include <bit>
#include <cmath>
#include <iterator>
#include <limits>

#include "rt_core/proxy/facet_screen.hpp"
#include "rt_core/proxy/lane_kernels.hpp"
#include "rt_core/proxy/near_pairs.hpp"
#include "rt_core/proxy/screen_numbers.hpp"

namespace haptic {
namespace {

/// Roundings of a gap, in those of the size of its row, and in those of its coordinates.
constexpr Real kGapRounding = 16 * 6.0e-8_r, kPlaceRounding = 8 * kRealEpsilon;
/// The height of a lane without a facet.
constexpr float kNoHeight = -1.0e9f;
/// Facets beyond this share of the range are listed apart: they are seldom looked at.
constexpr Real kNearShare = 0.4_r;
/// The slack of a row with facets in its lists counts up to so many ranges.
constexpr Real kMostSlack = 8;
/// A row is looked up again where its slack is less than this share of the range, or less than what
/// is needed; where blocks run short the range shrinks by the one factor, and grows by the other.
constexpr Real kNeedShare = 0.5_r, kFullShare = 0.6_r, kFullGrowth = 1.02_r;
/// Where fewer than this share of the blocks is free, lists become shorter little by little, but
/// reach this far beyond what is needed.
constexpr std::size_t kScarceShare = 6;
constexpr Real kScarceShrink = 0.95_r, kScarceNeeds = 2.5_r;
/// Rows are renewed in the order of their slack, in these shares of what they need; at last those
/// again to whose lists more facets come than may at once.
constexpr Real kLevels[] = {0.25_r, 0.5_r, 0.75_r, 1.0_r, 1.0_r};

}  // namespace

void FacetScreen::clear_block(std::uint32_t block) noexcept {
  const FloatLanes zero = all_lanes(0.0f);
  for (float(&normal)[kFloatLanes] : lists_.blocks[block].normal) store_floats(zero, normal);
  store_floats(all_lanes(kNoHeight), lists_.blocks[block].height_m);
  for (std::uint32_t& facet : lists_.lanes[block].facet) facet = kNoFacet;
  lists_.next[block] = kNoFacet;
}

/// The plane that touches the facet along this direction.
FacetScreen::Lane FacetScreen::plane_lane(const Row& row, std::uint32_t facet,
                                          const Vec3& normal_w) const noexcept {
  Lane lane;
  Vec3 rounded;
  for (int x = 0; x < 3; ++x) {
    lane.normal[x] = static_cast<float>(normal_w[x]);
    rounded[x] = static_cast<Real>(lane.normal[x]);
  }
  Real height_m = -std::numeric_limits<Real>::max();
  for (const Vec3& corner : corners_of(facet)) {
    height_m = std::max(height_m, rounded.dot(corner - row.origin_w));
  }
  lane.height_m = rounded_up(height_m);
  lane.facet = facet;
  return lane;
}

void FacetScreen::write(std::uint32_t block, std::uint32_t at, const Lane& lane) noexcept {
  ScreenBlock& to = lists_.blocks[block];
  for (int x = 0; x < 3; ++x) to.normal[x][at] = lane.normal[x];
  to.height_m[at] = lane.height_m;
  lists_.lanes[block].facet[at] = lane.facet;
}

/// Puts a facet into a chain; false: there is no block left.
bool FacetScreen::append(Row& row, Chain& chain, const Lane& lane, Real gap_m) noexcept {
  if (chain.used == kFloatLanes) {
    if (lists_.free.empty()) return false;
    const std::uint32_t id = lists_.free[lists_.free.size() - 1];
    lists_.free.truncate(lists_.free.size() - 1);
    clear_block(id);
    (chain.block == kNoFacet ? row.far : lists_.next[chain.block]) = id;
    chain.block = id;
    chain.used = 0;
  }
  write(chain.block, chain.used++, lane);
  chain.least_m = std::min(chain.least_m, rounded_down(gap_m - static_cast<Real>(row.rounding_m)));
  return true;
}

void FacetScreen::drop(std::uint32_t number, std::uint32_t facet) noexcept {
  for (const std::uint32_t chain : {number, a_.rows[number].far}) {
    for (std::uint32_t k = chain; k != kNoFacet; k = lists_.next[k]) {
      for (std::uint32_t at = 0; at < kFloatLanes; ++at) {
        if (lists_.lanes[k].facet[at] == facet) write(k, at, {{}, kNoHeight, kNoFacet});
      }
    }
  }
}

void FacetScreen::refuse(const ScreenMiss& miss) noexcept {
  float& slack_m = of(gaps_.slack_m, miss.row);
  slack_m = std::min(slack_m, rounded_down(miss.gap_m));
  clear_m_ = std::min(clear_m_, static_cast<Real>(slack_m));
}

/// True if a row has left the place that its planes are measured from.
bool FacetScreen::is_far_from_origin(const Row& row, const Placed& at, Real range_m) noexcept {
  const Real far_m = radius_of(at) + range_m;
  return (middle_of(at) - row.origin_w).squaredNorm() > far_m * far_m;
}

/// What a gap of a row's blocks is rounded by, as long as its slack lasts.
void FacetScreen::set_rounding(std::uint32_t number, const Placed& at, Real range_m) noexcept {
  Row& row = a_.rows[number];
  const Real size_m = 2 * radius_of(at) + (kMostSlack + 1) * range_m;
  const Real place_m =
      std::sqrt(row.origin_w.squaredNorm()) + size_m + static_cast<Real>(of(a_.lever_m, number));
  row.rounding_m = rounded_up(kGapRounding * size_m + kPlaceRounding * place_m);
}

/// The facets of a row's blocks that are within range stay, with their planes, where these leave
/// the least gap.
void FacetScreen::keep_listed(std::uint32_t number, LookUp& look) noexcept {
  Row& row = a_.rows[number];
  const Placed at{{look.at.corner_w[0], look.at.corner_w[1], look.at.corner_w[2]}};
  RowCorners corners;
  for (int x = 0; x < 3; ++x) {
    for (int c = 0; c < 4; ++c) {
      corners.at[x][c] = static_cast<float>(look.at.corner_w[std::min(c, 2)][x] - row.origin_w[x]);
    }
  }
  const std::uint32_t old[2] = {number, row.far};
  row.far = kNoFacet;
  for (const std::uint32_t chain : old) {
    for (std::uint32_t k = chain; k != kNoFacet;) {
      // A block that is given back is written to as soon as lanes of it are put into others.
      const ScreenBlock planes = lists_.blocks[k];
      const ScreenLanes lanes = lists_.lanes[k];
      alignas(32) float gap_m[kFloatLanes];
      if (!look.moves) LaneKernels{is_wide_}.block_gaps(planes, corners, gap_m);
      const std::uint32_t next = lists_.next[k];
      if (k == number) {
        clear_block(k);
      } else {
        static_cast<void>(lists_.free.push(k));
      }
      k = next;
      for (std::uint32_t i = 0; i < kFloatLanes; ++i) {
        const std::uint32_t facet = lanes.facet[i];
        if (facet == kNoFacet || b_.mark[facet] != b_.stamp) continue;
        work_ += kKeptWork;
        Lane lane{{planes.normal[0][i], planes.normal[1][i], planes.normal[2][i]},
                  planes.height_m[i],
                  facet};
        Real gap = look.moves ? Real{0} : static_cast<Real>(gap_m[i]);
        if (look.moves) {
          const Vec3 normal_w(static_cast<Real>(lane.normal[0]), static_cast<Real>(lane.normal[1]),
                              static_cast<Real>(lane.normal[2]));
          lane = plane_lane(row, facet, normal_w);
          gap = gap_along(normal_w, at, facet);
        }
        gap -= static_cast<Real>(row.rounding_m);
        if (gap < look.least_m) continue;  // it needs another plane
        b_.mark[facet] = b_.stamp + 1;
        if (gap > look.range_m) {
          look.others_m = std::min(look.others_m, gap);
        } else {
          put(row, look, lane, gap);
        }
      }
    }
  }
}

/// What is within range and in no list yet.
void FacetScreen::add_found(std::uint32_t number, const GripPose& p, const NearPairs& taken,
                            LookUp& look) noexcept {
  PlaneBatch batch{};
  std::uint32_t facets[kFloatLanes];
  std::uint32_t fresh = 0;
  for (const std::uint32_t facet : b_.found.first(look.found)) {
    if (b_.mark[facet] != b_.stamp) continue;
    work_ += kNewWork;
    if (taken.has(a_.piece[number], b_.tree.order()[facet])) continue;
    if (fresh++ == kMostNewFacets) {  // the others wait for the next time
      look.others_m = std::min(look.others_m, Real{0});
      break;
    }
    if (!fits_batch(facet)) {
      put_alone(number, facet, p, look);
      continue;
    }
    facets[batch.count] = facet;
    gather(batch, number, facet, p, nullptr);
    if (batch.count == kFloatLanes) put_batch(batch, facets, number, p, look);
  }
  put_batch(batch, facets, number, p, look);
}

/// Finds the facets within range of a row; those that are listed keep their planes.
void FacetScreen::look_up(std::uint32_t number, const GripPose& p, Real range_m, Real least_m,
                          const NearPairs& taken) noexcept {
  Row& row = a_.rows[number];
  const Shape& shape = a_.shape[number];
  const Placed at = placed(row, p);
  LookUp look;
  for (int k = 0; k < 3; ++k) {
    look.at.corner_w[k] = at.corner_w[k];
    look.at.outward_w[k] = p.r_wa * shape.outward[k];
  }
  look.at.normal_w = p.r_wa * shape.normal;
  look.range_m = range_m;
  look.least_m = least_m;
  const FacetTree::Found found = b_.tree.find(look.at, range_m, b_.found);
  work_ += kRowWork + kNodeWork * found.nodes + kLeafWork * found.leaves;
  look.others_m = found.others_m;
  if (b_.stamp > UINT32_MAX - 2) {
    for (std::uint32_t& mark : b_.mark) mark = 0;
    b_.stamp = 0;
  }
  b_.stamp += 2;
  for (std::uint32_t k = 0; k < found.count; ++k) b_.mark[b_.found[k]] = b_.stamp;
  // Its origin stays while the triangle is about there, for planes are measured from it.
  look.moves = is_far_from_origin(row, at, range_m);
  if (look.moves) row.origin_w = middle_of(at);
  set_rounding(number, at, range_m);
  look.near.block = number;
  look.near.used = 0;
  keep_listed(number, look);
  look.found = found.count;
  add_found(number, p, taken, look);
  if (look.near.used > 0 || row.far != kNoFacet) {
    look.others_m = std::min(look.others_m, kMostSlack * range_m);
  }
  of(gaps_.least_m, number) = look.near.least_m;
  of(gaps_.beyond_m, number) = look.far.least_m;
  of(gaps_.slack_m, number) = rounded_down(std::min(look.others_m, kLongest));
}

/// Puts a facet into the list of its distance.
void FacetScreen::put(Row& row, LookUp& look, const Lane& lane, Real gap_m) noexcept {
  Chain& chain = gap_m > kNearShare * look.range_m ? look.far : look.near;
  if (append(row, chain, lane, gap_m)) return;
  look.others_m = std::min(look.others_m, gap_m);
  lists_.is_full = true;
}

/// Takes what is not near from all lists.
void FacetScreen::shed() noexcept {
  for (std::uint32_t number = 0; number < a_.rows.size(); ++number) {
    Row& row = a_.rows[number];
    if (row.far == kNoFacet) continue;
    for (std::uint32_t k = row.far; k != kNoFacet; k = lists_.next[k]) {
      static_cast<void>(lists_.free.push(k));
      work_ += kBlockWork;
    }
    row.far = kNoFacet;
    float& slack_m = of(gaps_.slack_m, number);
    slack_m = std::min(slack_m, of(gaps_.beyond_m, number));
    clear_m_ = std::min(clear_m_, static_cast<Real>(slack_m));
    of(gaps_.beyond_m, number) = kNoGap;
  }
}

void FacetScreen::renew(const GripPose& p, Real need_m, Real range_m, Real least_m,
                        std::uint32_t most_work, const NearPairs& taken) noexcept {
  lost_.misses.clear();
  if (clear_m_ >= need_m) return;
  end_.known = end_.done = lists_.is_full = false;
  const std::uint32_t begin = work_;
  range_m = lists_.range_m = std::min(range_m, lists_.most_range_m);
  const Real asked_m = need_m;
  need_m = std::min(need_m, kNeedShare * range_m);
  bool was_full = false;
  std::uint32_t level = 0;
  while (level < std::size(kLevels) && work_ - begin < most_work) {
    const FloatLanes below = all_lanes(static_cast<float>(kLevels[level++] * need_m));
    for (std::size_t k = 0; k < gaps_.slack_m.size(); ++k) {
      std::uint32_t due = lanes_below(load_floats(gaps_.slack_m[k].x), below);
      for (; due != 0 && work_ - begin < most_work; due &= due - 1) {
        const auto lane = static_cast<std::uint32_t>(std::countr_zero(due));
        look_up(static_cast<std::uint32_t>(k) * kFloatLanes + lane, p, range_m, least_m, taken);
      }
    }
    if (!lists_.is_full || was_full) continue;
    // Once more, with the blocks that shorter lists leave.
    was_full = true;
    level = 0;
    shed();
    lists_.is_full = false;
    range_m = lists_.range_m = kFullShare * range_m;
    need_m = std::min(need_m, kNeedShare * range_m);
  }
  FloatLanes clear = all_lanes(kNoGap), nearest = clear;
  for (std::size_t k = 0; k < gaps_.slack_m.size(); ++k) {
    clear = smaller(clear, load_floats(gaps_.slack_m[k].x));
    nearest = smaller(nearest,
                      smaller(load_floats(gaps_.least_m[k].x), load_floats(gaps_.beyond_m[k].x)));
  }
  clear_m_ = static_cast<Real>(least_lane(clear));
  nearest_m_ = static_cast<Real>(least_lane(nearest));
  // Where there are not blocks enough the lists are shorter for a while.
  const bool is_scarce = lists_.free.size() < lists_.free.capacity() / kScarceShare &&
                         range_m > kScarceNeeds * asked_m;
  lists_.most_range_m = was_full    ? range_m
                        : is_scarce ? kScarceShrink * range_m
                                    : std::min(kFullGrowth * lists_.most_range_m, kLongest);
}

bool FacetScreen::take_back(std::uint32_t piece_a, std::uint32_t facet_of_scene, const GripPose& p,
                            Real least_m) noexcept {
  const std::uint32_t facet = b_.number[facet_of_scene];
  const std::uint32_t begin = a_.first[piece_a];
  std::uint32_t end = begin + 1;
  while (end < a_.rows.size() && a_.piece[end] == piece_a) ++end;
  const auto find = [&](std::uint32_t number, Tried& tried) {
    const Placed at = placed(a_.rows[number], p);
    Between between{number, facet};
    between.p = &p;
    between.at_p = &at;
    between.need_m = least_m + static_cast<Real>(a_.rows[number].rounding_m);
    return find_plane(between, tried) || find_closest(at, between, tried);
  };
  Tried tried;
  for (std::uint32_t number = begin; number < end; ++number) {
    tried = {};
    if (!find(number, tried)) return false;
  }
  for (std::uint32_t number = begin; number < end; ++number) {
    Row& row = a_.rows[number];
    if (end - begin > 1) {
      tried = {};
      static_cast<void>(find(number, tried));
    }
    const Plane& plane = tried.best;
    drop(number, facet);
    if (is_unlisted(number)) {
      const Placed at = placed(row, p);
      row.origin_w = middle_of(at);
      set_rounding(number, at, lists_.range_m);
      float& slack_m = of(gaps_.slack_m, number);
      slack_m = std::min(slack_m, rounded_down(kMostSlack * lists_.range_m));
    }
    // A place that was left, or a block of its own.
    const Lane lane = plane_lane(row, facet, plane.normal_w);
    Chain chain{number};
    bool placed_in = false;
    for (std::uint32_t k = number; k != kNoFacet && !placed_in; k = lists_.next[k]) {
      chain.block = k;
      for (std::uint32_t at = 0; at < kFloatLanes && !placed_in; ++at) {
        if (lists_.lanes[k].facet[at] != kNoFacet) continue;
        write(k, at, lane);
        placed_in = true;
      }
    }
    if (!placed_in && !append(row, chain, lane, plane.gap_p_m)) {
      refuse({number, piece_a, facet_of_scene, plane.gap_p_m});
      continue;
    }
    float& least = of(gaps_.least_m, number);
    least = std::min(least, rounded_down(plane.gap_p_m - static_cast<Real>(row.rounding_m)));
  }
  end_.known = end_.done = false;
  return true;
}

/// True if a row has no facet in its lists.
bool FacetScreen::is_unlisted(std::uint32_t number) const noexcept {
  if (a_.rows[number].far != kNoFacet || lists_.next[number] != kNoFacet) return false;
  const auto& facets = lists_.lanes[number].facet;
  return std::all_of(std::begin(facets), std::end(facets),
                     [](std::uint32_t facet) { return facet == kNoFacet; });
}

}  // namespace haptic
